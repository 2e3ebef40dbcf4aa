//! Meshes the decorative cube with fidget: `isospline-peers DEPTH FILE` writes the vertices (f64) and
//! triangles (u32) of manifold dual contouring on an octree of that depth, and prints the seconds.

use fidget::context::Tree;
use fidget::jit::JitShape;
use fidget::mesh::{Octree, Settings};
use std::error::Error;
use std::io::{BufWriter, Write};
use std::time::Instant;

/// Half the side of the cube that is meshed; fidget's own reaches from -1 to 1.
const HALF_SIDE: f32 = 1.18;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().collect();
    let [_, depth, path] = args.as_slice() else {
        return Err("usage: isospline-peers DEPTH FILE".into());
    };
    let shape = JitShape::from(decorative_cube()).try_into()?;
    let start = Instant::now();
    let settings = Settings { depth: depth.parse()?, ..Settings::default() };
    let octree = Octree::build(&shape, &settings).ok_or("fidget was cancelled")?;
    let mesh = octree.walk_dual();
    let seconds = start.elapsed().as_secs_f64();

    let mut out = BufWriter::new(std::fs::File::create(path)?);
    out.write_all(&u64::try_from(mesh.vertices.len())?.to_le_bytes())?;
    for vertex in &mesh.vertices {
        for coordinate in vertex.iter() {
            out.write_all(&(f64::from(*coordinate) * f64::from(HALF_SIDE)).to_le_bytes())?;
        }
    }
    for corner in mesh.triangles.iter().flat_map(|t| t.iter()) {
        out.write_all(&u32::try_from(*corner)?.to_le_bytes())?;
    }
    out.flush()?;
    println!("{seconds}");
    Ok(())
}

/// `configs/deccube.toml`, scaled into fidget's cube.
fn decorative_cube() -> Tree {
    let [x, y, z] = [Tree::x(), Tree::y(), Tree::z()].map(|t| (t * HALF_SIDE).square());
    let ring = |a: &Tree, b: &Tree, c: &Tree| {
        (a.clone() + b.clone() - 0.64).square() + (c.clone() - 1.0).square()
    };
    ring(&x, &y, &z) * ring(&y, &z, &x) * ring(&z, &x, &y) - 0.02
}
