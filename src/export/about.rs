//! What a file says of the model besides its shape.

/// Name, unit and origin of a surface, for formats that have a place for them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct About {
    /// Name of the model.
    pub name: String,
    /// What a coordinate of 1 means.
    pub unit: LengthUnit,
    /// Where the surface comes from, in a line: formula, faces, error.
    pub provenance: String,
}

/// A unit of length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum LengthUnit {
    /// 1e-6 m.
    #[serde(rename = "um")]
    Micrometre,
    /// 1e-3 m; what CAD programs take for granted, and so the default.
    #[default]
    #[serde(rename = "mm")]
    Millimetre,
    /// 1e-2 m.
    #[serde(rename = "cm")]
    Centimetre,
    /// 1 m.
    #[serde(rename = "m")]
    Metre,
    /// 0.0254 m.
    #[serde(rename = "in")]
    Inch,
    /// 0.3048 m.
    #[serde(rename = "ft")]
    Foot,
}
