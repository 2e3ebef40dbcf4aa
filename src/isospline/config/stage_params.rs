//! The tables of the stages, one field a stage.

use crate::config::tables::{out_of_range, typed};
use crate::config::{ConfigError, Document};
use isospline_stage::Params;

/// The parameter of a stage that is not its own but `target.faces`.
const FACES: &str = "faces";

macro_rules! stage_params {
    ($($stage:ident: $params:ty),* $(,)?) => {
        /// Parameters of all stages.
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct StageParams {
            $(#[doc = concat!("Table `[", stringify!($stage), "]`.")]
            pub $stage: $params,)*
        }

        impl StageParams {
            /// Names of the tables, in the order of the pipeline.
            pub const NAMES: &'static [&'static str] = &[$(stringify!($stage)),*];

            /// Reads the tables; `faces` goes to the stages that take it.
            pub(crate) fn read(doc: &Document, faces: u32) -> Result<Self, ConfigError> {
                Ok(Self { $($stage: stage_table(doc, stringify!($stage), faces)?),* })
            }

            /// The same parameters for another number of faces.
            #[must_use]
            pub fn with_faces(&self, faces: u32) -> Self {
                Self { $($stage: sized(&self.$stage, faces)),* }
            }

            /// The table of a stage, as the pipeline takes it.
            ///
            /// # Panics
            /// If there is no such stage.
            pub fn json(&self, stage: &str) -> serde_json::Value {
                match stage {
                    $(stringify!($stage) => json(&self.$stage),)*
                    _ => panic!("no stage is called {stage:?}"),
                }
            }

            /// The tables as values, without what [`StageParams::read`] puts in.
            pub(crate) fn tables(&self) -> Vec<(&'static str, toml::Table)> {
                vec![$((stringify!($stage), own_table(&self.$stage))),*]
            }
        }
    };
}

stage_params! {
    import: isospline_import::ImportParams,
    polygonize: isospline_polygonize::PolygonizeParams,
    decimate: isospline_decimate::DecimateParams,
    project: isospline_project::ProjectParams,
    adapt: isospline_adapt::AdaptParams,
    curvature: isospline_curvature::CurvatureParams,
    network: isospline_network::NetworkParams,
    g0_fit: isospline_g0_fit::G0FitParams,
    vertex_systems: isospline_vertex_systems::VertexSystemsParams,
    edge_systems: isospline_edge_systems::EdgeSystemsParams,
    fairing: isospline_fairing::FairingParams,
    relax: isospline_relax::RelaxParams,
}

fn stage_table<P: Params>(doc: &Document, stage: &str, faces: u32) -> Result<P, ConfigError> {
    let own = doc.table().get(stage).and_then(|value| value.get(FACES));
    if own.is_some() && has_faces(&P::default()) {
        let key = format!("{stage}.{FACES}");
        let place = doc.key_place(&key);
        return Err(ConfigError::Elsewhere { key, instead: "target.faces", place });
    }
    let own: P = typed(doc, stage, &[])?;
    if let Some(key) = not_finite(&own) {
        return Err(out_of_range(doc, &format!("{stage}.{key}"), "a finite number"));
    }
    let params: P = sized(&own, faces);
    params.validate().map_err(|(key, message)| {
        let owner = if key == FACES { "target" } else { stage };
        out_of_range(doc, &format!("{owner}.{key}"), message)
    })?;
    Ok(params)
}

/// The first key whose value JSON has no word for: infinite, or not a number.
fn not_finite(params: &impl Params) -> Option<String> {
    let table = json(params);
    let found = table.as_object()?.iter().find(|(_, value)| value.is_null());
    found.map(|(key, _)| key.clone())
}

fn has_faces(params: &impl Params) -> bool {
    json(params).get(FACES).is_some()
}

fn sized<P: Params>(params: &P, faces: u32) -> P {
    let mut table = json(params);
    if let Some(slot) = table.get_mut(FACES) {
        *slot = faces.into();
    }
    serde_json::from_value(table).expect("invariant: a table reads back as what wrote it")
}

fn own_table(params: &impl Params) -> toml::Table {
    let mut table = toml::Table::try_from(params).expect("invariant: parameters are a table");
    table.remove(FACES);
    table
}

fn json(params: &impl Params) -> serde_json::Value {
    serde_json::to_value(params).expect("invariant: parameters are a table")
}
