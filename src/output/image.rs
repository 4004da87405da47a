//! Figures as PNG and PDF, converted from the SVG with the font that `kuva` carries: the fonts of the machine play no
//! part, so that the bytes are the same everywhere.

use std::sync::{Arc, OnceLock};

use base64::Engine as _;
use kuva::backend::svg::SvgBackend;
use kuva::render::render::Scene;
use resvg::{tiny_skia, usvg};

/// Pixels of the SVG an inch.
const SVG_DPI: f32 = 96.0;
/// Dots an inch of a PNG: fit for print.
const PNG_DPI: f32 = 300.0;

/// A figure as PNG, 300 dots per inch (18 cm wide: 2125 pixels).
///
/// # Errors
///
/// A message when the text is no SVG or too large to be drawn.
pub fn png(svg: &str) -> Result<Vec<u8>, String> {
    let tree = parse(svg)?;
    let scale = PNG_DPI / SVG_DPI;
    let size = tree.size().to_int_size();
    let size = size.scale_by(scale).ok_or("the figure is too large")?;
    let mut pixels = tiny_skia::Pixmap::new(size.width(), size.height())
        .ok_or("the figure is too large for a PNG")?;
    let transform = tiny_skia::Transform::from_scale(scale, scale);
    resvg::render(&tree, transform, &mut pixels.as_mut());
    pixels.encode_png().map_err(|error| error.to_string())
}

/// A figure as PDF of one page, as wide as it is on paper. Texts are text, with the part of the font that they use.
///
/// # Errors
///
/// A message when the text is no SVG or cannot be converted.
pub fn pdf(svg: &str) -> Result<Vec<u8>, String> {
    let page = svg2pdf::PageOptions { dpi: SVG_DPI };
    let options = svg2pdf::ConversionOptions::default();
    svg2pdf::to_pdf(&parse(svg)?, options, page).map_err(|error| error.to_string())
}

fn parse(svg: &str) -> Result<usvg::Tree, String> {
    let options = usvg::Options {
        fontdb: fonts(),
        font_family: "DejaVu Sans".to_string(),
        ..usvg::Options::default()
    };
    usvg::Tree::from_str(svg, &options).map_err(|error| error.to_string())
}

/// DejaVu Sans alone. kuva hands its fonts out only inside an SVG.
fn fonts() -> Arc<usvg::fontdb::Database> {
    static FONTS: OnceLock<Arc<usvg::fontdb::Database>> = OnceLock::new();
    let load = || {
        let mut fonts = usvg::fontdb::Database::new();
        let carrier = SvgBackend::new().with_embedded_font(true);
        let svg = carrier.render_scene(&Scene::new(1.0, 1.0));
        let regular = svg.split("base64,").nth(1).unwrap_or_default();
        let regular = regular.split('\'').next().unwrap_or_default();
        if let Ok(font) = base64::engine::general_purpose::STANDARD.decode(regular) {
            fonts.load_font_data(font);
        }
        Arc::new(fonts)
    };
    FONTS.get_or_init(load).clone()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_dot_is_drawn() {
        let mut scene = crate::output::svg::empty(40.0, 40.0);
        crate::output::draw::dots(&mut scene, &[(20.0, 20.0)], "#000000", 8.0);
        let tree = parse(&crate::output::svg::document(&scene)).unwrap();
        let mut pixels = tiny_skia::Pixmap::new(40, 40).unwrap();
        resvg::render(
            &tree,
            tiny_skia::Transform::identity(),
            &mut pixels.as_mut(),
        );
        let dot = pixels.pixel(20, 20).unwrap();
        assert!(dot.alpha() == 255 && dot.red() < 10, "{dot:?}");
    }

    #[test]
    fn texts_in_a_pdf_are_text() {
        let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"90\" height=\"20\">\
                   <text x=\"2\" y=\"15\" font-family=\"DejaVu Sans\">speed</text></svg>";
        let bytes = pdf(svg).unwrap();
        let has = |word: &[u8]| bytes.windows(word.len()).any(|w| w == word);
        assert!(has(b"DejaVuSans") && has(b"/ToUnicode"));
    }

    #[test]
    fn the_font_is_there_and_has_the_signs_of_the_axes() {
        let fonts = fonts();
        assert_eq!(fonts.faces().next().unwrap().families[0].0, "DejaVu Sans");
        for c in "Ω×⁻⁵²−ωζ…".chars() {
            let svg = format!(
                "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"20\" height=\"20\">\
                 <text x=\"2\" y=\"15\" font-family=\"DejaVu Sans\">{c}</text></svg>"
            );
            // A text without a glyph has no box.
            assert!(parse(&svg).unwrap().root().has_children(), "{c}");
        }
    }
}
