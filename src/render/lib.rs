//! Surfaces become pictures: exact normals and curvatures at every sample, no tessellation seen.
//!
//! Each tile of the picture cuts the patches that it may show into triangles finer than a pixel,
//! which say what every sample sees and about where (`tile`); Newton's method then meets the line
//! of sight with the patch itself (`landing`), and what is shown is evaluated there (`shader`).

mod camera;
mod canvas;
mod color;
mod error;
mod file;
mod landing;
mod legend;
mod lent_threads;
mod material;
mod net;
mod patch;
mod picture;
mod scale;
mod shader;
mod style;
mod surface;
mod tile;

#[cfg(test)]
mod sample;
#[cfg(test)]
mod seen_from_outside;

pub use camera::{Camera, View};
pub use error::RenderError;
pub use file::{write_png, write_png_file};
pub use lent_threads::{ForEach, on_this_thread};
pub use picture::{Job, Picture, render};
pub use style::{Options, Style};
pub use surface::Surface;
