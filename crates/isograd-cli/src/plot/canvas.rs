//! A picture in memory: anti-aliased lines, discs, rectangles and text, written as PNG.

use std::io::{self, Write};
use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};

/// Red, green and blue, each from 0 to 1, as screens show them (sRGB).
pub type Color = [f32; 3];

/// Black.
pub const BLACK: Color = [0.0; 3];
/// White.
pub const WHITE: Color = [1.0; 3];
/// Of text and axes.
pub const INK: Color = [0.13, 0.15, 0.18];
/// Of lines that only help.
pub const FAINT: Color = [0.86, 0.87, 0.89];

/// The font travels in the program: a machine may have none.
static FONT: LazyLock<Option<FontRef<'static>>> =
    LazyLock::new(|| FontRef::try_from_slice(dejavu::sans::regular()).ok());

/// Which part of a text stands at the given place, along the text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Anchor {
    /// Its beginning.
    Start,
    /// Its middle.
    Middle,
    /// Its end.
    End,
}

/// Pixels, row by row from the top.
#[derive(Clone, Debug)]
pub struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<Color>,
}

impl Canvas {
    /// A canvas of one color.
    pub fn new(width: usize, height: usize, color: Color) -> Self {
        Self {
            width,
            height,
            pixels: vec![color; width * height],
        }
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Color of a pixel; `None` beyond the edge.
    pub fn pixel(&self, x: usize, y: usize) -> Option<Color> {
        (x < self.width).then(|| self.pixels.get(y * self.width + x).copied())?
    }

    /// Lays `color` over a pixel, `alpha` of it. Places beyond the edge are passed over.
    pub fn blend(&mut self, x: i64, y: i64, color: Color, alpha: f32) {
        let inside = x >= 0 && y >= 0 && x < self.width as i64 && y < self.height as i64;
        if !inside || !(alpha > 0.0) {
            return;
        }
        let pixel = &mut self.pixels[y as usize * self.width + x as usize];
        let alpha = alpha.min(1.0);
        for (old, new) in pixel.iter_mut().zip(color) {
            *old += alpha * (new - *old);
        }
    }

    /// Lays `color` over every pixel of a box, as much as `coverage(x, y)` of its center says.
    fn shade(
        &mut self,
        [x0, y0, x1, y1]: [f32; 4],
        color: Color,
        coverage: impl Fn(f32, f32) -> f32,
    ) {
        let clip = |v: f32, limit: usize| (v.max(0.0) as usize).min(limit);
        let rows = clip(y0.floor(), self.height)..clip(y1.ceil(), self.height);
        let columns = clip(x0.floor(), self.width)..clip(x1.ceil(), self.width);
        for y in rows {
            for x in columns.clone() {
                let alpha = coverage(x as f32 + 0.5, y as f32 + 0.5);
                self.blend(x as i64, y as i64, color, alpha);
            }
        }
    }

    /// A filled box, from `(x0, y0)` to `(x1, y1)`.
    pub fn rectangle(&mut self, [x0, y0, x1, y1]: [f32; 4], color: Color) {
        let part = |low: f32, high: f32, center: f32| {
            ((center + 0.5).min(high) - (center - 0.5).max(low)).clamp(0.0, 1.0)
        };
        self.shade([x0, y0, x1, y1], color, |x, y| {
            part(x0, x1, x) * part(y0, y1, y)
        });
    }

    /// The outline of a box.
    pub fn frame(&mut self, [x0, y0, x1, y1]: [f32; 4], width: f32, color: Color) {
        let corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]];
        for side in corners.windows(2) {
            self.line(side[0], side[1], width, color, 1.0);
        }
    }

    /// A straight line with round ends.
    pub fn line(&mut self, a: [f32; 2], b: [f32; 2], width: f32, color: Color, alpha: f32) {
        let reach = 0.5 * width + 1.0;
        let bounds = [
            a[0].min(b[0]) - reach,
            a[1].min(b[1]) - reach,
            a[0].max(b[0]) + reach,
            a[1].max(b[1]) + reach,
        ];
        let along = [b[0] - a[0], b[1] - a[1]];
        let length_squared = (along[0] * along[0] + along[1] * along[1]).max(1e-12);
        self.shade(bounds, color, |x, y| {
            let to = [x - a[0], y - a[1]];
            let t = ((to[0] * along[0] + to[1] * along[1]) / length_squared).clamp(0.0, 1.0);
            let off = (to[0] - t * along[0]).hypot(to[1] - t * along[1]);
            alpha * (0.5 * width + 0.5 - off).clamp(0.0, 1.0)
        });
    }

    /// Copies a picture to `(x, y)`.
    pub fn paste(&mut self, picture: &Canvas, x: usize, y: usize) {
        for (row, line) in picture
            .pixels
            .chunks_exact(picture.width.max(1))
            .enumerate()
        {
            for (column, &color) in line.iter().enumerate() {
                self.blend((x + column) as i64, (y + row) as i64, color, 1.0);
            }
        }
    }

    /// A line of text whose middle line runs through `at`.
    pub fn text(&mut self, text: &str, at: [f32; 2], anchor: Anchor, size: f32) {
        self.place_text(text, at, anchor, size, |along, down| [along, down]);
    }

    /// Text that reads upward.
    pub fn text_upward(&mut self, text: &str, at: [f32; 2], anchor: Anchor, size: f32) {
        self.place_text(text, at, anchor, size, |along, down| [down, -along]);
    }

    fn place_text(
        &mut self,
        text: &str,
        at: [f32; 2],
        anchor: Anchor,
        size: f32,
        turn: impl Fn(f32, f32) -> [f32; 2],
    ) {
        let Some(font) = FONT.as_ref() else {
            return;
        };
        let (glyphs, length) = layout(font, text, size);
        let start = match anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => -0.5 * length,
            Anchor::End => -length,
        };
        for glyph in glyphs {
            let Some(outline) = font.outline_glyph(glyph) else {
                continue;
            };
            let corner = outline.px_bounds().min;
            outline.draw(|x, y, coverage| {
                let along = start + corner.x + x as f32;
                let [dx, dy] = turn(along, corner.y + y as f32);
                let place = [(at[0] + dx).floor() as i64, (at[1] + dy).floor() as i64];
                self.blend(place[0], place[1], INK, coverage);
            });
        }
    }

    /// Shrinks by a whole number: each pixel is the mean of `factor²`.
    pub fn shrunk(&self, factor: usize) -> Self {
        let mut small = Self::new(self.width / factor, self.height / factor, WHITE);
        for y in 0..small.height {
            for x in 0..small.width {
                let mut sum = [0.0; 3];
                for (dy, dx) in (0..factor).flat_map(|dy| (0..factor).map(move |dx| (dy, dx))) {
                    let pixel = self.pixels[(y * factor + dy) * self.width + x * factor + dx];
                    sum = [sum[0] + pixel[0], sum[1] + pixel[1], sum[2] + pixel[2]];
                }
                small.pixels[y * small.width + x] = sum.map(|s| s / (factor * factor) as f32);
            }
        }
        small
    }

    /// Writes the picture as PNG, 8 bits a color.
    ///
    /// # Errors
    /// An error of `out`.
    pub fn write_png(&self, out: &mut impl Write) -> io::Result<()> {
        let bytes: Vec<u8> = self
            .pixels
            .iter()
            .flatten()
            .map(|&c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)
            .collect();
        // In memory first: the encoder would lose the kind of an error of `out`.
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&bytes)?;
        writer.finish()?;
        out.write_all(&file)
    }
}

/// Length of a line of text in pixels.
pub fn text_length(text: &str, size: f32) -> f32 {
    FONT.as_ref().map_or(0.0, |font| layout(font, text, size).1)
}

/// The glyphs of a line, its middle line at height 0, and its length.
fn layout(font: &FontRef, text: &str, size: f32) -> (Vec<Glyph>, f32) {
    let scaled = font.as_scaled(PxScale::from(size));
    // Digits reach up to about seven tenths of the ascent: half of that is the middle.
    let middle = 0.36 * scaled.ascent();
    let mut along = 0.0;
    let mut glyphs = Vec::new();
    let mut previous = None;
    for character in text.chars() {
        let mut glyph = scaled.scaled_glyph(character);
        along += previous.map_or(0.0, |p| scaled.kern(p, glyph.id));
        glyph.position = point(along, middle);
        along += scaled.h_advance(glyph.id);
        previous = Some(glyph.id);
        glyphs.push(glyph);
    }
    (glyphs, along)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_font_has_every_letter_that_plots_use() {
        let font = FONT.as_ref().expect("the font is sound");
        for letter in "φ∇|−0123456789.e·xyz=²³ ±".chars() {
            assert_ne!(font.glyph_id(letter).0, 0, "{letter}");
        }
        assert!(text_length("φ = 0", 20.0) > 20.0);
    }

    #[test]
    fn a_line_covers_what_it_should_and_nothing_beyond_the_edge() {
        let mut canvas = Canvas::new(20, 10, WHITE);
        canvas.line([-5.0, 5.0], [40.0, 5.0], 2.0, BLACK, 1.0);
        assert_eq!(canvas.pixel(10, 4), Some(BLACK));
        assert_eq!(canvas.pixel(10, 5), Some(BLACK));
        assert_eq!(canvas.pixel(10, 8), Some(WHITE));
        assert_eq!(canvas.pixel(20, 5), None);
        canvas.line([f32::NAN, 0.0], [1.0, 1.0], 1.0, BLACK, 1.0);
    }

    #[test]
    fn shrinking_takes_the_mean() {
        let mut canvas = Canvas::new(4, 2, WHITE);
        canvas.rectangle([0.0, 0.0, 1.0, 2.0], BLACK);
        let small = canvas.shrunk(2);
        assert_eq!(small.pixel(0, 0), Some([0.5; 3]));
        assert_eq!(small.pixel(1, 0), Some(WHITE));
    }

    #[test]
    fn the_png_can_be_read_back() {
        let mut canvas = Canvas::new(7, 3, WHITE);
        canvas.rectangle([0.0, 0.0, 2.0, 2.0], [1.0, 0.0, 0.0]);
        let mut bytes = Vec::new();
        canvas.write_png(&mut bytes).expect("a vector takes it");
        let decoder = png::Decoder::new(std::io::Cursor::new(bytes));
        let mut reader = decoder.read_info().expect("a PNG");
        let mut pixels = vec![0; 7 * 3 * 3];
        reader.next_frame(&mut pixels).expect("a frame");
        assert_eq!(&pixels[..9], [255, 0, 0, 255, 0, 0, 255, 255, 255]);
    }
}
