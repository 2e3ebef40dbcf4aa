//! The model file that goes with the artifacts: every key, in one order.

use crate::config::ModelFile;
use std::fmt::Write as _;

impl ModelFile {
    /// The whole model as TOML; reading it back gives an equal model.
    ///
    /// Every key is written, defaults too, so a later release with other defaults still reads
    /// the model that the artifacts were made from.
    pub fn to_toml(&self) -> String {
        let mut text = String::from("# Written by isospline; `check` and `status` read it.\n");
        write_table(&mut text, "model", &value(&self.model));
        write_table(&mut text, "target", &value(&self.target));
        write_table(&mut text, "check", &value(&self.check));
        for (stage, table) in self.stages.tables() {
            if !table.is_empty() {
                write_table(&mut text, stage, &table);
            }
        }
        text
    }
}

fn value(table: &impl serde::Serialize) -> toml::Table {
    toml::Table::try_from(table).expect("invariant: a table of plain values")
}

fn write_table(text: &mut String, name: &str, table: &toml::Table) {
    let body = toml::to_string(&toml::Table::from_iter([(name.to_owned(), table.clone().into())]))
        .expect("invariant: plain values have a TOML form");
    writeln!(text, "\n{}", body.trim_end()).expect("invariant: a string takes all text");
}
