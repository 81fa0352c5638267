use super::*;

#[test]
fn svg_of_every_mark_holds_titles_axes_and_legends() {
    let mut panel = Panel::new("Panel", ("x (m)", Scale::Log), ("y (s)", Scale::Linear { from_zero: true }));
    for (i, mark) in
        [Mark::Line, Mark::Dashed, Mark::Dots, Mark::Faint, Mark::Ring, Mark::Rule].into_iter().enumerate()
    {
        panel.series.push(Series::new(format!("series {i}"), mark, i, [(1.0, 2.0), (10.0, 3.0)]));
    }
    let names = Scale::Names(vec!["one".to_owned(), "two".to_owned()]);
    let mut bars = Panel::new("Bars", ("", names), ("y (s)", Scale::Linear { from_zero: true }));
    bars.series.push(Series::new("bar", Mark::Bars, 0, [(0.0, 2.0), (1.0, 3.0)]));
    let text = svg("Title", &[panel, bars]).unwrap();
    for part in ["Title", "Panel", "x (m)", "y (s)", "series 5", "Bars", "two", "bar", "<svg"] {
        assert!(text.contains(part), "{part} is missing");
    }
}

#[test]
fn stacked_bars_stand_upon_each_other_and_reach_their_sum() {
    let names = Scale::Names(vec!["one".to_owned()]);
    let bars = |heights: &[f64]| {
        let mut panel = Panel::new("", ("", names.clone()), ("", Scale::Linear { from_zero: true }));
        for (i, y) in heights.iter().enumerate() {
            panel.series.push(Series::new("", Mark::Stacked, i, [(0.0, *y)]));
        }
        let text = svg("", &[panel]).unwrap();
        let of = |line: &str, key: &str| -> i32 {
            let rest = &line[line.find(&format!(" {key}=\"")).unwrap() + key.len() + 3..];
            rest[..rest.find('"').unwrap()].parse().unwrap()
        };
        let wide =
            text.lines().filter(|l| l.starts_with("<rect") && of(l, "width") > 100 && of(l, "width") < 900);
        wide.map(|l| (of(l, "y"), of(l, "height"))).collect::<Vec<_>>()
    };
    let two = bars(&[3.0, 1.0]);
    assert_eq!(two.len(), 2);
    // The upper ends where the lower begins; the lower is three times as high, to a pixel.
    assert_eq!(two[1].0 + two[1].1, two[0].0);
    assert!((two[0].1 - 3 * two[1].1).abs() <= 2, "{two:?}");
    // Together they are the bar of their sum.
    let one = bars(&[4.0]);
    assert_eq!((one[0].0, one[0].1), (two[1].0, two[0].1 + two[1].1));
}

#[test]
fn wrapped_lines_keep_all_words_within_the_width() {
    assert_eq!(wrap("one two  three", 7), ["one two", "three"]);
    assert_eq!(wrap("", 7), Vec::<String>::new());
    assert_eq!(wrap("muchlonger x", 4), ["muchlonger", "x"]);
}

#[cfg(feature = "explore")]
#[test]
fn png_has_the_size_of_the_svg_and_holds_ink() {
    let mut panel = Panel::new("Panel", ("x", Scale::Log), ("y", Scale::Linear { from_zero: true }));
    panel.series.push(Series::new("line", Mark::Line, 1, [(1.0, 2.0), (10.0, 3.0)]));
    let sheet = Sheet { title: "Title".to_owned(), notes: vec!["note".to_owned()], panels: vec![panel] };
    let bytes = png(&sheet).unwrap();
    let mut reader = ::png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
    let mut data = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut data).unwrap();
    let (width, height) = sheet.size();
    assert_eq!((info.width, info.height), (width * figure::PIXELS, height * figure::PIXELS));
    let has = |rgb: [u8; 3]| data.chunks(3).any(|p| p == rgb);
    assert!(has([255; 3]) && has([0, 114, 178]), "paper and the line's colour");
    // The title is painted: dark pixels in its place.
    let row = |y: usize| &data[3 * y * info.width as usize..3 * (y + 1) * info.width as usize];
    assert!((0..44).any(|y| row(y).iter().any(|c| *c < 128)));
    assert_eq!(bytes, png(&sheet).unwrap());
}
