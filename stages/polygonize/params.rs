//! Parameters of stage polygonize.

use isospline_stage::Params;
use serde::{Deserialize, Serialize};

/// Parameters of stage polygonize.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PolygonizeParams {
    /// Faces wanted of the base mesh; filled in from `target.faces`. Unit: faces; range 4 to
    /// 100 000 000; default 5000. The resolution follows from it.
    pub faces: u32,
    /// Triangles made for each face wanted. Unit: 1; range 1 to 16; default 2. More cost time and
    /// give decimation more to choose from.
    pub oversampling: f64,
    /// Cells along the longest side of the box. Unit: cells; range 0 or 2 to 4096; default 0, which
    /// means that `faces` decides.
    pub cells: u32,
    /// How often a cell may be halved where the topology test fails. Unit: 1; range 0 to 6;
    /// default 5. Below it the topology is observed only, or refused.
    pub max_depth: u32,
    /// Cells that the surface may touch before the run is refused. Unit: cells; range 1000 to
    /// 100 000 000; default 4 000 000, about 1 GB.
    pub max_cells: u32,
    /// Size of a component below which it is left out: the diagonal of its box, of that of the
    /// whole surface. Unit: 1; range 0 to below 1; default 0, which keeps all.
    pub drop_below: f64,
}

impl Default for PolygonizeParams {
    fn default() -> Self {
        Self {
            faces: 5000,
            oversampling: 2.0,
            cells: 0,
            max_depth: 5,
            max_cells: 4_000_000,
            drop_below: 0.0,
        }
    }
}

impl Params for PolygonizeParams {
    fn validate(&self) -> Result<(), (&'static str, String)> {
        let within = |x: u32, min: u32, max: u32| (min..=max).contains(&x);
        if !within(self.faces, 4, 100_000_000) {
            return Err(("faces", format!("{} is not within 4 to 100000000", self.faces)));
        }
        if !(1.0..=16.0).contains(&self.oversampling) {
            return Err(("oversampling", format!("{} is not within 1 to 16", self.oversampling)));
        }
        if self.cells != 0 && !within(self.cells, 2, 4096) {
            return Err(("cells", format!("{} is neither 0 nor within 2 to 4096", self.cells)));
        }
        if self.max_depth > 6 {
            return Err(("max_depth", format!("{} is not within 0 to 6", self.max_depth)));
        }
        if !within(self.max_cells, 1000, 100_000_000) {
            return Err(("max_cells", format!("{} is not within 1000 to 1e8", self.max_cells)));
        }
        if !(0.0..1.0).contains(&self.drop_below) {
            return Err(("drop_below", format!("{} is not within 0 to below 1", self.drop_below)));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_values_out_of_range_are_named() {
        assert_eq!(PolygonizeParams::default().validate(), Ok(()));
        let key = |change: fn(&mut PolygonizeParams)| {
            let mut params = PolygonizeParams::default();
            change(&mut params);
            params.validate().unwrap_err().0
        };
        assert_eq!(key(|p| p.faces = 3), "faces");
        assert_eq!(key(|p| p.oversampling = f64::NAN), "oversampling");
        assert_eq!(key(|p| p.cells = 1), "cells");
        assert_eq!(key(|p| p.max_depth = 7), "max_depth");
        assert_eq!(key(|p| p.max_cells = 0), "max_cells");
        assert_eq!(key(|p| p.drop_below = f64::NAN), "drop_below");
    }
}
