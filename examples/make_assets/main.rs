//! Writes the meshes and textures that the scenes name into `assets/`.
//!
//! `cargo run --release --example make_assets` writes them into the repository, where they are
//! kept; with the name of a folder it writes them there. `-- --keys` prints the key lists of the
//! scenes instead. Everything follows from the numbers in this program: each run gives the same
//! files, which a test holds.

mod figure;
mod glb;
mod keys;
mod knife;
mod noise;
mod relief;
mod surface_net;
mod textures;
mod water;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{EncodableLayout, ImageBuffer, Luma, PixelWithColorType, Rgb};
use std::error::Error;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    let argument = std::env::args().nth(1);
    if argument.as_deref() == Some("--keys") {
        for (name, keys) in keys::ALL {
            println!("{name}:{}\n", keys());
        }
        return Ok(());
    }
    let folder = argument
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("assets"), PathBuf::from);
    fs::create_dir_all(&folder)?;
    fs::write(folder.join("knife-blade.obj"), knife::blade())?;
    fs::write(folder.join("knife-handle.obj"), knife::handle())?;
    for (name, mesh) in meshes() {
        fs::write(folder.join(name), mesh.to_glb())?;
    }
    for (name, painting) in &textures::ALL {
        let (width, height) = painting.size;
        let image = ImageBuffer::from_fn(width, height, |x, y| Rgb(painting.pixel(x, y)));
        save(&image, &folder.join(name))?;
    }
    let heights = ImageBuffer::from_fn(512, 512, |x, y| Luma([relief::height_code(x, y, 512)]));
    save(&heights, &folder.join("relief-height.png"))?;
    let normals = ImageBuffer::from_fn(1024, 1024, |x, y| Rgb(relief::normal_codes(x, y, 1024)));
    save(&normals, &folder.join("relief-normals.png"))?;
    Ok(())
}

/// The meshes with their files: fine ones for pictures, and a coarse rabbit whose facets show.
fn meshes() -> [(&'static str, glb::Mesh); 3] {
    let (rabbit, fish) = (figure::rabbit(), figure::fish());
    [
        ("rabbit.glb", surface_net::surface_net(&rabbit, 0.0122)),
        ("rabbit-coarse.glb", surface_net::surface_net(&rabbit, 0.045)),
        ("fish.glb", surface_net::surface_net(&fish, 0.004)),
    ]
}

/// Writes a PNG as small as the encoder can make it: these files are kept.
fn save<P>(image: &ImageBuffer<P, Vec<P::Subpixel>>, path: &Path) -> Result<(), Box<dyn Error>>
where
    P: PixelWithColorType,
    [P::Subpixel]: EncodableLayout,
{
    let file = BufWriter::new(File::create(path)?);
    let encoder = PngEncoder::new_with_quality(file, CompressionType::Best, FilterType::Adaptive);
    image.write_with_encoder(encoder)?;
    Ok(())
}
