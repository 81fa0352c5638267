//! A back end whose units are some pixels of another: pictures of the same layout, with finer lines and letters.

use plotters::prelude::*;
use plotters_backend::{BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingErrorKind};

/// `inner`, with `pixels` of it a unit.
pub(super) struct Scaled<B> {
    pub(super) inner: B,
    pub(super) pixels: u32,
}

type Outcome<B> = Result<(), DrawingErrorKind<<B as DrawingBackend>::ErrorType>>;

impl<B: DrawingBackend> Scaled<B> {
    fn at(&self, (x, y): BackendCoord) -> BackendCoord {
        (x * self.pixels as i32, y * self.pixels as i32)
    }

    fn style(&self, style: &impl BackendStyle, fill: bool) -> ShapeStyle {
        let BackendColor { alpha, rgb: (r, g, b) } = style.color();
        ShapeStyle {
            color: RGBAColor(r, g, b, alpha),
            filled: fill,
            stroke_width: style.stroke_width() * self.pixels,
        }
    }
}

impl<B: DrawingBackend> DrawingBackend for Scaled<B> {
    type ErrorType = B::ErrorType;

    fn get_size(&self) -> (u32, u32) {
        let (width, height) = self.inner.get_size();
        (width / self.pixels, height / self.pixels)
    }

    fn ensure_prepared(&mut self) -> Outcome<B> {
        self.inner.ensure_prepared()
    }

    fn present(&mut self) -> Outcome<B> {
        self.inner.present()
    }

    fn draw_pixel(&mut self, point: BackendCoord, color: BackendColor) -> Outcome<B> {
        let (x, y) = self.at(point);
        let end = (x + self.pixels as i32 - 1, y + self.pixels as i32 - 1);
        self.inner.draw_rect((x, y), end, &color, true)
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Outcome<B> {
        self.draw_path([from, to], style)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        upper_left: BackendCoord,
        bottom_right: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Outcome<B> {
        let (from, to, style) = (self.at(upper_left), self.at(bottom_right), self.style(style, fill));
        self.inner.draw_rect(from, to, &style, fill)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Outcome<B> {
        let path: Vec<BackendCoord> = path.into_iter().map(|p| self.at(p)).collect();
        let style = self.style(style, false);
        self.inner.draw_path(path, &style)
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        center: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Outcome<B> {
        let (center, radius, style) = (self.at(center), radius * self.pixels, self.style(style, fill));
        self.inner.draw_circle(center, radius, &style, fill)
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        vert: I,
        style: &S,
    ) -> Outcome<B> {
        let corners: Vec<BackendCoord> = vert.into_iter().map(|p| self.at(p)).collect();
        let style = self.style(style, true);
        self.inner.fill_polygon(corners, &style)
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, pos: BackendCoord) -> Outcome<B> {
        let font = FontDesc::new(style.family(), style.size() * f64::from(self.pixels), style.style());
        let style =
            TextStyle { font: font.transform(style.transform()), color: style.color(), pos: style.anchor() };
        let at = self.at(pos);
        self.inner.draw_text(text, &style, at)
    }
}
