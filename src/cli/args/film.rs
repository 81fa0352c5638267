//! How camera rays become pixels, as typed: filter, region, adaptive sampling, quality, interruption.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::render::{MAX_SAMPLES, Region};

/// From rays to pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FilterArg {
    /// The mean of the pixel's own rays
    Box,
    /// Falls to 0 at the neighbours' centres
    Tent,
    /// A bell, standard deviation half a pixel
    Gaussian,
    /// Mitchell and Netravali's cubic: sharp; what its negative lobes make negative becomes 0 and is counted
    Mitchell,
}

/// One knob over elements, camera rays and shadow rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum QualityArg {
    /// A quick look: a quarter of the scene's elements
    Draft,
    /// The scene's elements, edges without stairs
    Normal,
    /// For print: four times the scene's elements
    High,
}

/// Camera rays per pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SamplesArg {
    /// Of every pixel.
    pub min: u32,
    /// Most of a pixel, where more than `min` are possible.
    pub max: Option<u32>,
}

pub(super) fn samples(text: &str) -> Result<SamplesArg, String> {
    let expected = || {
        format!("expected a number in 1..={MAX_SAMPLES}, or MIN..MAX of such numbers, as in 1..{MAX_SAMPLES}")
    };
    let number = |text: &str| text.parse::<u32>().ok().filter(|n| (1..=MAX_SAMPLES).contains(n));
    let (min, max) = match text.split_once("..") {
        None => (number(text).ok_or_else(expected)?, None),
        Some((min, max)) => {
            let max = number(max.strip_prefix('=').unwrap_or(max)).ok_or_else(expected)?;
            (number(min).filter(|min| *min <= max).ok_or_else(expected)?, Some(max))
        }
    };
    Ok(SamplesArg { min, max: max.filter(|max| *max > min) })
}

fn contrast(text: &str) -> Result<f64, String> {
    let contrast = text.parse().ok().filter(|c: &f64| (0.001..=1.0).contains(c));
    contrast.ok_or_else(|| "expected a difference of tones from 0.001 to 1, such as 0.03".to_owned())
}

fn region(text: &str) -> Result<Region, String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, width, height]) if width > 0 && height > 0 => Ok(Region { x, y, width, height }),
        _ => Err("expected four whole numbers x,y,width,height (pixels, from the top left), width and height at least 1".to_owned()),
    }
}

/// How camera rays become pixels.
#[derive(Debug, Args)]
pub struct FilmArgs {
    /// One knob over elements, camera rays and shadow rays; what is given beside it (--elements, --samples, --contrast,
    /// --shadow-strata, --shadow-error) wins [default: none, each of these has its own default]
    #[arg(long, value_enum)]
    pub quality: Option<QualityArg>,
    /// With --samples MIN..MAX: difference of tones (0 black to 1 white) between neighbours that calls for more rays; a
    /// quarter of it is the standard error that does [default: 0.03]
    #[arg(long, value_name = "TONES", allow_negative_numbers = true, value_parser = contrast, help_heading = "Film")]
    pub contrast: Option<f64>,
    /// From camera rays to pixels; all but box keep 24 bytes for every camera ray
    #[arg(long, value_enum, value_name = "FILTER", default_value = "box", help_heading = "Film")]
    pub filter: FilterArg,
    /// Render only this part of the picture: the same pixels, bit for bit, as in the whole one. The exposure 'auto' of a .png is
    /// then the part's own
    #[arg(long, value_name = "X,Y,W,H", value_parser = region, allow_hyphen_values = true, help_heading = "Film")]
    pub region: Option<Region>,
    /// Also write a picture of the number of camera rays of each pixel: black none, white the most that are allowed
    #[arg(long, value_name = "FILE.png", help_heading = "Film")]
    pub sample_map: Option<PathBuf>,
    /// At Ctrl-C in pass 2 write the picture so far, one ray of every pixel before the second of any, and exit with status
    /// 130; a second Ctrl-C writes nothing. Without it Ctrl-C writes nothing: files are as they were
    #[arg(long, help_heading = "Film")]
    pub partial: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_a_number_or_a_range_within_1_to_16() {
        let of = |min, max| Ok(SamplesArg { min, max });
        assert_eq!(samples("1"), of(1, None));
        assert_eq!(samples("16"), of(16, None));
        assert_eq!(samples("1..16"), of(1, Some(16)));
        assert_eq!(samples("2..=9"), of(2, Some(9)));
        assert_eq!(samples("4..4"), of(4, None));
        for bad in ["0", "17", "-1", "", "..", "1..", "..4", "4..2", "1..17", "0..3", "a", "1.5", "1...4"] {
            assert!(samples(bad).unwrap_err().contains("MIN..MAX"), "{bad}");
        }
    }

    #[test]
    fn region_is_four_numbers_with_a_size() {
        assert_eq!(region("1, 2,30,4"), Ok(Region { x: 1, y: 2, width: 30, height: 4 }));
        for bad in ["1,2,3", "1,2,3,4,5", "-1,0,3,3", "0,0,0,3", "0,0,3,0", "a,b,c,d", "", "1.5,0,3,3"] {
            assert!(region(bad).unwrap_err().contains("x,y,width,height"), "{bad}");
        }
    }
}
