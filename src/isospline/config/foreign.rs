//! Model files of other programs as model files of this one.

use crate::config::{ConfigError, Place, Source};
use isospline_implicit::{ForeignError, ForeignFormat, ForeignModel};
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;
use toml::Value;

/// The text of the model file that says the same as `text`, the content of a foreign file.
///
/// # Errors
/// [`ConfigError::Foreign`] with the line.
pub fn foreign_as_toml(
    path: &Path,
    format: ForeignFormat,
    text: &str,
) -> Result<String, ConfigError> {
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into());
    let model = format.read(text).map_err(|error| refusal(path, text, error))?;
    Ok(toml_text(&name, &model))
}

fn toml_text(name: &str, model: &ForeignModel) -> String {
    let mut out = format!("# Made from {name:?}.\n\n[model]\n");
    let formula = Value::String(model.formula.clone());
    let mut line = |text: std::fmt::Arguments<'_>| {
        out.write_fmt(text).expect("invariant: a string takes all text");
    };
    // Lines of their own are easier to edit than one string with \n in it.
    if model.formula.contains('\n') && !model.formula.contains("'''") {
        line(format_args!("formula = '''\n{}\n'''\n", model.formula));
    } else {
        line(format_args!("formula = {formula}\n"));
    }
    if let Some(r) = model.view_radius {
        line(format_args!("# The part that the other program shows.\n"));
        line(format_args!("box = [[{:?}, {r:?}], [{:?}, {r:?}], [{:?}, {r:?}]]\n", -r, -r, -r));
    }
    if !model.parameters.is_empty() {
        line(format_args!("\n[model.parameters]\n"));
    }
    for (name, value) in &model.parameters {
        line(format_args!("{} = {value:?}\n", Value::String(name.clone())));
    }
    out
}

fn refusal(path: &Path, text: &str, error: ForeignError) -> ConfigError {
    let before: usize = text.split_inclusive('\n').take(error.line - 1).map(str::len).sum();
    let line = text[before..].lines().next().unwrap_or("");
    let range = before..before + line.len();
    let source = Arc::new(Source { name: path.display().to_string(), text: text.to_owned() });
    ConfigError::Foreign { error: Box::new(error), place: Place { source, range } }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Document, Domain, ModelFile};

    fn model(file: &str, text: &str) -> ModelFile {
        let path = Path::new(file);
        let format = ForeignFormat::of(path).unwrap();
        let toml = foreign_as_toml(path, format, text).unwrap();
        ModelFile::from_document(&Document::parse(file, &toml).unwrap()).unwrap()
    }

    #[test]
    fn a_gallery_file_becomes_formula_parameters_and_box() {
        let text = "surface_equation=x^2+y^2+z^2-a\nscale_factor=0.5\nsurface_parameter_a=1.5\n";
        let model = model("kugel.jsurf", text).model;
        assert_eq!(model.formula, "x^2+y^2+z^2-a");
        assert_eq!(model.parameters["a"].to_bits(), 1.5_f64.to_bits());
        let Domain::Given(sides) = model.domain else { panic!("{:?}", model.domain) };
        assert!(
            sides.iter().all(|[lo, hi]| (lo + hi).abs() < 1e-15 && (hi * hi - 10.0).abs() < 1e-12)
        );
    }

    #[test]
    fn an_op_list_becomes_lines_that_can_be_edited() {
        let text = "_a var-x\n_b const 1e-3\n_c mul _a _b\n";
        let toml = foreign_as_toml(Path::new("a.vm"), ForeignFormat::Vm, text).unwrap();
        assert!(toml.contains("_b = 0.001\n_c = _a * _b\n"), "{toml}");
        let model = model("a.vm", text).model;
        assert_eq!(model.domain, Domain::Auto);
        assert_eq!(model.formula.trim_end().lines().last(), Some("_c"));
    }

    #[test]
    fn awkward_text_stays_text() {
        let text = "surface_equation=x \"'''\\n\\\\ y\nsurface_parameter_a\\ b=1\n";
        let toml = foreign_as_toml(Path::new("a\n.jsurf"), ForeignFormat::Jsurf, text).unwrap();
        let document = Document::parse("a", &toml).unwrap();
        let formula = document.table()["model"]["formula"].as_str().unwrap();
        assert_eq!(formula, "x \"'''\n\\ y");
    }

    #[test]
    fn a_refusal_points_at_the_line() {
        let text = "a var-x\nb twist a\n";
        let error = foreign_as_toml(Path::new("d/a.vm"), ForeignFormat::Vm, text).unwrap_err();
        assert_eq!(error.to_string(), "line 2: unknown operation `twist`");
        let place = error.place().unwrap();
        assert_eq!((place.line(), &place.source.text[place.range.clone()]), (2, "b twist a"));
    }
}
