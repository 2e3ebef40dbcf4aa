//! Stage adapt: a projected mesh becomes a base mesh that is fit to carry patches.

pub mod freeze;
pub mod order;
