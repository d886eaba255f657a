//! A calibration board as a PDF page for printing at true scale, with a ruler to check the print.

use std::borrow::Cow;

use capture::{CharucoTarget, Target};
use pdf_writer::{Content, Finish, Name, Pdf, Rect, Ref, Str};
use remedy::Remedy;
use vision::{CharucoError, CharucoParams};

/// Points of PDF per millimetre.
const POINTS_PER_MM: f32 = 72.0 / 25.4;

/// White margin around the board, mm: printers cannot print to the edge, and detection needs a margin.
const MARGIN_MM: f64 = 10.0;

/// Height of the footer below the board, with ruler and text, mm.
const FOOTER_MM: f64 = 16.0;

/// Maximum length of the ruler, mm.
const RULER_MAX_MM: f64 = 200.0;

/// Page sizes, smallest first: (name, short side, long side), mm.
const PAGES: [(&str, f64, f64); 5] = [
    ("A4", 210.0, 297.0),
    ("A3", 297.0, 420.0),
    ("A2", 420.0, 594.0),
    ("A1", 594.0, 841.0),
    ("A0", 841.0, 1189.0),
];

/// Why a board cannot be printed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SheetError {
    /// The board is larger than any page.
    #[error("a board of {width_mm:.0}×{height_mm:.0} mm does not fit on any page up to A0")]
    TooLarge {
        /// Width with its margins.
        width_mm: f64,
        /// Height with margins and ruler.
        height_mm: f64,
    },
    /// The markers do not exist.
    #[error(transparent)]
    Markers(#[from] CharucoError),
}

impl Remedy for SheetError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(match self {
            Self::TooLarge { .. } => "use smaller or fewer squares".into(),
            Self::Markers(cause) => return cause.remedy(),
        })
    }
}

/// A page for printing.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetSheet {
    /// The bytes of the PDF file.
    pub pdf: Vec<u8>,
    /// Page size: `A4` to `A0`.
    pub page: &'static str,
    /// Length of the printed ruler, mm.
    pub ruler_mm: f64,
}

/// A black rectangle: left, top, width, height, mm from the top left of the board.
type Black = [f64; 4];

/// The board on the smallest page that holds it, in portrait or landscape; `text` is printed in the footer.
///
/// # Errors
/// [`SheetError`].
pub fn target_sheet(target: &Target, text: &str) -> Result<TargetSheet, SheetError> {
    let square = target.square_mm();
    let (inner_columns, inner_rows) = target.inner_corners();
    let (columns, rows) = match target.circles() {
        Some((_, true)) => (2 * inner_columns, inner_rows),
        Some((_, false)) => (inner_columns, inner_rows),
        None => (inner_columns + 1, inner_rows + 1),
    };
    let board_mm = [columns as f64 * square.x_mm, rows as f64 * square.y_mm];
    let (width_mm, height_mm) = (board_mm[0] + 2.0 * MARGIN_MM, board_mm[1] + 2.0 * MARGIN_MM + FOOTER_MM);
    let fits = |&&(_, short, long): &&(&str, f64, f64)| {
        width_mm.max(height_mm) <= long && width_mm.min(height_mm) <= short
    };
    let &(page, short, long) = PAGES.iter().find(fits).ok_or(SheetError::TooLarge { width_mm, height_mm })?;
    let page_mm = if width_mm > height_mm { [long, short] } else { [short, long] };
    let origin_mm = [(page_mm[0] - board_mm[0]) / 2.0, (page_mm[1] - FOOTER_MM - board_mm[1]) / 2.0];
    let ruler_mm = ((page_mm[0] - 2.0 * MARGIN_MM) / 10.0).floor().min(RULER_MAX_MM / 10.0) * 10.0;
    let mut black: Vec<Black> = if target.circles().is_some() { Vec::new() } else { black_squares(target) };
    let discs: Vec<Disc> =
        discs(target).into_iter().map(|[x, y, r]| [x + origin_mm[0], y + origin_mm[1], r]).collect();
    if let Target::Charuco(board) = target {
        black.extend(markers(board)?);
    }
    for rectangle in &mut black {
        rectangle[0] += origin_mm[0];
        rectangle[1] += origin_mm[1];
    }
    black.extend(ruler(ruler_mm, page_mm));
    Ok(TargetSheet { pdf: pdf(page_mm, &black, &discs, &footer(text, ruler_mm)), page, ruler_mm })
}

/// A black disc: centre, in mm from the top left of the board, and radius in mm.
type Disc = [f64; 3];

/// The discs of a circle grid, half a spacing from the edge of the board.
fn discs(target: &Target) -> Vec<Disc> {
    let Some((grid, asymmetric)) = target.circles() else { return Vec::new() };
    let steps = |column: usize, row: usize| if asymmetric { 2 * column + row % 2 } else { column };
    let places = (0..grid.rows).flat_map(|row| (0..grid.columns).map(move |column| (column, row)));
    places
        .map(|(column, row)| {
            let x = (steps(column, row) as f64 + 0.5) * grid.square_mm.x_mm;
            [x, (row as f64 + 0.5) * grid.square_mm.y_mm, 0.5 * grid.diameter_mm]
        })
        .collect()
}

/// The black squares; the one at the top left is black.
fn black_squares(target: &Target) -> Vec<Black> {
    let square = target.square_mm();
    let (inner_columns, inner_rows) = target.inner_corners();
    let places = (0..=inner_rows).flat_map(|row| (0..=inner_columns).map(move |column| (column, row)));
    places
        .filter(|(column, row)| (column + row) % 2 == 0)
        .map(|(column, row)| [column as f64 * square.x_mm, row as f64 * square.y_mm, square.x_mm, square.y_mm])
        .collect()
}

/// The black cells of the markers in the white squares, numbered row by row; runs of cells are one rectangle.
fn markers(board: &CharucoTarget) -> Result<Vec<Black>, CharucoError> {
    let params = CharucoParams {
        columns: board.columns,
        rows: board.rows,
        marker_ratio: board.marker_mm / board.square_mm.x_mm,
        dictionary: board.dictionary.clone(),
    };
    params.check()?;
    let places = (0..board.rows).flat_map(|row| (0..board.columns).map(move |column| (column, row)));
    let mut black = Vec::new();
    for (id, (column, row)) in places.filter(|(column, row)| (column + row) % 2 == 1).enumerate() {
        let cells = params.marker_cells(id).unwrap_or_default();
        let cell = params.marker_ratio / cells.len() as f64;
        let (width, height) = (cell * board.square_mm.x_mm, cell * board.square_mm.y_mm);
        let margin = 0.5 * (1.0 - params.marker_ratio);
        let left = (column as f64 + margin) * board.square_mm.x_mm;
        let top = (row as f64 + margin) * board.square_mm.y_mm;
        for (y, cells) in cells.iter().enumerate() {
            let mut x = 0;
            for run in cells.chunk_by(|a, b| a == b) {
                if run[0] {
                    black.push([
                        left + x as f64 * width,
                        top + y as f64 * height,
                        run.len() as f64 * width,
                        height,
                    ]);
                }
                x += run.len();
            }
        }
    }
    Ok(black)
}

/// The ruler: a line with a tick every 10 mm, in the footer.
fn ruler(length_mm: f64, page_mm: [f64; 2]) -> Vec<Black> {
    const LINE_MM: f64 = 0.1;
    let (left, y) = ((page_mm[0] - length_mm) / 2.0, page_mm[1] - FOOTER_MM);
    let tick = |idx: usize| {
        let height = if idx.is_multiple_of(5) { 4.0 } else { 2.5 };
        [left + 10.0 * idx as f64 - LINE_MM / 2.0, y - height, LINE_MM, height]
    };
    let ticks = (0..=(length_mm / 10.0).round() as usize).map(tick);
    ticks.chain([[left, y - LINE_MM / 2.0, length_mm, LINE_MM]]).collect()
}

fn footer(text: &str, ruler_mm: f64) -> [String; 2] {
    let check = format!(
        "Print at 100 %. The ruler is {ruler_mm:.0} mm long: check this and the squares in both directions, and correct square_mm if they differ."
    );
    [text.to_owned(), check]
}

/// One page with black rectangles and discs, and two lines of text in the footer.
fn pdf(page_mm: [f64; 2], black: &[Black], discs: &[Disc], text: &[String; 2]) -> Vec<u8> {
    let [catalogue, pages, page, font, content] = [1, 2, 3, 4, 5].map(Ref::new);
    let points = |mm: f64| mm as f32 * POINTS_PER_MM;
    let mut drawn = Content::new();
    for &[left, top, width, height] in black {
        drawn.rect(points(left), points(page_mm[1] - top - height), points(width), points(height));
    }
    for &[x, y, radius] in discs {
        draw_disc(&mut drawn, [points(x), points(page_mm[1] - y)], points(radius));
    }
    drawn.fill_nonzero();
    for (line, text) in text.iter().enumerate() {
        let below_mm = FOOTER_MM - 5.0 - 4.5 * line as f64;
        drawn.begin_text();
        drawn.set_font(Name(b"F1"), 8.0);
        drawn.next_line(points(MARGIN_MM), points(below_mm));
        drawn.show(Str(latin(text).as_slice()));
        drawn.end_text();
    }
    let mut pdf = Pdf::new();
    pdf.catalog(catalogue).pages(pages);
    pdf.pages(pages).kids([page]).count(1);
    let mut sheet = pdf.page(page);
    sheet.parent(pages).contents(content);
    sheet.media_box(Rect::new(0.0, 0.0, points(page_mm[0]), points(page_mm[1])));
    sheet.resources().fonts().pair(Name(b"F1"), font);
    sheet.finish();
    pdf.type1_font(font).base_font(Name(b"Helvetica")).encoding_predefined(Name(b"WinAnsiEncoding"));
    pdf.stream(content, &drawn.finish());
    pdf.finish()
}

/// A circle of four cubic Bézier curves, accurate to 0.03 % of the radius.
fn draw_disc(drawn: &mut Content, [x, y]: [f32; 2], radius: f32) {
    const HANDLE: f32 = 0.552_284_8;
    let at = |[a, b]: [f32; 2]| [x + radius * a, y + radius * b];
    drawn.move_to(x + radius, y);
    for [c, s] in [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]] {
        let [a, b, to] = [at([c - HANDLE * s, s + HANDLE * c]), at([HANDLE * c - s, HANDLE * s + c]), at([-s, c])];
        drawn.cubic_to(a[0], a[1], b[0], b[1], to[0], to[1]);
    }
    drawn.close_path();
}

/// Encodes text for the built-in fonts; other characters become question marks.
fn latin(text: &str) -> Vec<u8> {
    text.chars().map(|c| u8::try_from(u32::from(c)).unwrap_or(b'?')).collect()
}

#[cfg(test)]
mod tests {
    use capture::{ChessboardTarget, CirclesTarget};

    use super::*;

    fn chessboard(inner_columns: usize, square_mm: f64) -> Target {
        ChessboardTarget { inner_columns, inner_rows: 6, square_mm: square_mm.into() }.into()
    }

    #[test]
    fn a_board_is_placed_on_the_smallest_page_that_holds_it() {
        let page = |square_mm| target_sheet(&chessboard(9, square_mm), "").map(|sheet| sheet.page);
        assert_eq!(page(20.0), Ok("A4"));
        assert_eq!(page(30.0), Ok("A3"));
        assert!(matches!(page(300.0), Err(SheetError::TooLarge { .. })));
    }

    #[test]
    fn every_other_square_is_black_starting_at_the_top_left() {
        let squares = black_squares(&chessboard(9, 20.0));
        assert_eq!(squares.len(), 35);
        assert_eq!(squares[0], [0.0, 0.0, 20.0, 20.0]);
        assert_eq!(squares[5], [20.0, 20.0, 20.0, 20.0]);
    }

    #[test]
    fn the_rows_of_an_asymmetric_grid_are_staggered() {
        let grid = CirclesTarget { columns: 4, rows: 11, square_mm: 15.0.into(), diameter_mm: 12.0 };
        let discs = discs(&Target::AsymmetricCircles(grid));
        assert_eq!(discs.len(), 44);
        assert_eq!(discs[0], [7.5, 7.5, 6.0]);
        assert_eq!(discs[4], [22.5, 22.5, 6.0]);
        assert_eq!(discs[43], [3.0 * 30.0 + 7.5, 10.0 * 15.0 + 7.5, 6.0]);
    }

    #[test]
    fn the_ruler_has_its_stated_length() {
        let drawn = ruler(180.0, [210.0, 297.0]);
        let (first, last) = (drawn[0], drawn[18]);
        assert!((last[0] - first[0] - 180.0).abs() < 1e-9);
    }
}
