//! Pictures of methods: strips of columns, one strip above the other.

use crate::cli::paper::rows::Row;
use crate::cli::paper::test_case::{Method, Shown};
use crate::export::sheet::{self, Column, PALETTE, Sheet, signed_error};
use crate::export::text::Canvas;
use crate::export::tone::{Look, ToneMap, auto_exposure};
use crate::render::film::{Image, Rect};

/// Colour of the truth's column, that of none of the methods.
const TRUTH: [u8; 3] = PALETTE[7];

/// What a picture is made of.
pub struct Picture<'a> {
    /// The methods.
    pub methods: &'a [Method],
    /// Their images, all of the truth's size.
    pub shown: &'a Shown,
    /// Their numbers.
    pub rows: &'a [Row],
    /// The truth.
    pub truth: &'a Image,
    /// Factor of enlargement; 0 averages images wider than [`WIDTH`] down to it.
    pub enlarge: u32,
}

/// Width of an image that is shown as a whole, pixels.
pub const WIDTH: u32 = 320;

/// A strip of methods.
pub struct Strip {
    /// Heading.
    pub title: String,
    /// Line below it.
    pub subtitle: String,
    /// Indices of methods, from left to right.
    pub methods: Vec<usize>,
    /// Whether the truth follows them.
    pub truth: bool,
    /// Whether each has its error below it.
    pub errors: bool,
}

impl Picture<'_> {
    /// Draws strips one above the other, all with one exposure: the truth's.
    pub fn draw(&self, strips: &[Strip]) -> Canvas {
        let exposure = auto_exposure(self.truth);
        let mut canvases = strips.iter().map(|s| self.strip(s, exposure));
        let first = canvases.next().unwrap_or_else(|| Canvas::new([1, 1], [0; 3]));
        canvases.fold(first, |above, below| above.above(&below))
    }

    fn strip(&self, strip: &Strip, exposure: f32) -> Canvas {
        let size = self.truth.size;
        let shown = match self.enlarge {
            0 if size[0] > WIDTH => [WIDTH, (u64::from(size[1]) * u64::from(WIDTH) / u64::from(size[0])).max(1) as u32],
            _ => size,
        };
        let column = |title: String, lines: Vec<String>, color: [u8; 3], image: &Image, error: Option<Image>| Column {
            title,
            lines,
            color,
            image: if shown == size { image.clone() } else { image.resampled(shown) },
            look: Look::Tone(ToneMap::srgb(exposure)),
            error: error.filter(|_| strip.errors),
        };
        let mut columns: Vec<Column> = strip
            .methods
            .iter()
            .enumerate()
            .map(|(place, &i)| {
                let image = &self.shown.images[i];
                let color = PALETTE[place % (PALETTE.len() - 1)];
                let error = signed_error(image, self.truth);
                column(self.methods[i].title.into(), self.rows[i].lines(), color, image, Some(error))
            })
            .collect();
        if strip.truth {
            let lines = vec!["regular, 16×16 view rays,".into(), "all that overlap".into()];
            columns.push(column("Truth".into(), lines, TRUTH, self.truth, None));
        }
        sheet::draw(&Sheet {
            title: strip.title.clone(),
            subtitle: strip.subtitle.clone(),
            columns,
            crop: Rect::whole(shown),
            enlarge: self.enlarge.max(1),
        })
    }
}
