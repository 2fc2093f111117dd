//! Pictures without a browser: `mpm-par plot`.
//!
//! | file | idea |
//! |---|---|
//! | `mod.rs` | the file, its format and its font |
//! | `points.rs` | points of a frame, coloured by a field |
//! | `curves.rs` | columns of a table |
//!
//! plotters draws, to SVG or PNG by the file's ending; a font of the printable ASCII characters is part
//! of the program (DejaVu, see `assets/`), so that a machine without fonts draws too.

mod curves;
mod points;

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

pub use curves::Curves;
pub use points::Picture;

use super::whole_file::write_whole;
use crate::error::{Error, Result};

const FONT: &[u8] = include_bytes!("assets/DejaVuSans-ascii.ttf");
/// Height of the letters, pixels.
const LETTERS: i32 = 20;

/// A drawing on any backend; an error in words.
trait Drawing {
    /// Width and height, pixels.
    fn size(&self) -> (u32, u32);

    fn draw<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
    ) -> std::result::Result<(), String>;
}

/// Draws to `path`, whose ending chooses the format.
///
/// # Errors
/// `Input` for an ending other than .png and .svg, `File` if the file cannot be written.
fn to_file(path: &Path, drawing: &impl Drawing) -> Result<()> {
    // Registered once; a second time changes nothing.
    let _ = register_font("sans-serif", FontStyle::Normal, FONT);
    let (width, height) = drawing.size();
    let failed = |why: String| Error::File(format!("cannot draw {}: {why}", path.display()));
    let bytes = match path.extension().and_then(|end| end.to_str()) {
        Some("svg") => {
            let mut text = String::new();
            drawing
                .draw(&SVGBackend::with_string(&mut text, (width, height)).into_drawing_area())
                .map_err(failed)?;
            text.into_bytes()
        }
        Some("png") => {
            let mut pixels = vec![255; 3 * (width * height) as usize];
            {
                let backend = BitMapBackend::with_buffer(&mut pixels, (width, height));
                drawing.draw(&backend.into_drawing_area()).map_err(failed)?;
            }
            encoded(&pixels, width, height).map_err(failed)?
        }
        _ => {
            return Err(Error::Input(format!(
                "{}: expected a name that ends in .png or .svg",
                path.display()
            )));
        }
    };
    write_whole(path, &bytes)
}

/// A PNG of red, green and blue bytes.
fn encoded(pixels: &[u8], width: u32, height: u32) -> std::result::Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().map_err(|reason| reason.to_string())?;
    writer.write_image_data(pixels).map_err(|reason| reason.to_string())?;
    writer.finish().map_err(|reason| reason.to_string())?;
    Ok(bytes)
}

/// Shortest text of a tick of an axis of this length: `0`, `1.5`, `-2e6`.
fn tick(value: f64, length: f64) -> String {
    let size = value.abs();
    if size <= 1e-9 * length {
        "0".into()
    } else if (1e-3..1e5).contains(&size) {
        // Sums of steps have a last digit of round-off.
        let text = format!("{value:.6}");
        text.trim_end_matches('0').trim_end_matches('.').into()
    } else {
        let text = format!("{value:.3e}");
        let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
        format!("{}e{power}", digits.trim_end_matches('0').trim_end_matches('.'))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_short() {
        let texts = [0.0, 1.5, 0.1 + 0.2, -2e6, 12345.0, 1e-4, 7e-18].map(|x| tick(x, 0.1));
        assert_eq!(texts, ["0", "1.5", "0.3", "-2e6", "12345", "1e-4", "0"]);
    }
}
