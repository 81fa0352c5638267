//! The rays file of `simulate`: one ray a line, `ox,oy,oz,dx,dy,dz[,t_max]`.
//!
//! Origin in metres, direction of any length, t_max in lengths of the direction (absent: no end). Empty lines and
//! lines that start with `#` are skipped. Files of test vectors are another thing: `vectors.rs`.

use std::path::Path;

use super::CliError;
use super::plan::MAX_COORDINATE_M;
use super::vectors::read_bytes;
use crate::geom::{DVec3, Ray};
use crate::report::si::vector;
use crate::vectors::VectorsFormat;

/// Largest component of a direction: what the casters' products carry.
const DIRECTION_LENGTHS: std::ops::RangeInclusive<f64> = 1e-60..=1e60;

/// Reads a rays file.
///
/// # Errors
/// The first bad line with its number, what it says and what was expected; a file without rays; test vectors.
pub(super) fn read_rays(path: &Path) -> Result<Vec<Ray>, CliError> {
    let bytes = read_bytes(path, "a rays file")?;
    if VectorsFormat::sniff(&bytes).is_some() {
        return Err(CliError::Usage(format!(
            "{}: test vectors bring their own patches and take no SCENE: radeng simulate --rays {0}",
            path.display()
        )));
    }
    let text = String::from_utf8(bytes).map_err(|_| CliError::Read {
        path: path.to_owned(),
        what: "not UTF-8 text, expected a rays file".to_owned(),
    })?;
    parse_rays(&text).map_err(|(line, what)| CliError::Rays { path: path.to_owned(), line, what })
}

fn parse_rays(text: &str) -> Result<Vec<Ray>, (usize, String)> {
    let mut rays = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.trim();
        if !line.is_empty() && !line.starts_with('#') {
            rays.push(parse_ray(line).map_err(|what| (i + 1, what))?);
        }
    }
    if rays.is_empty() {
        return Err((text.lines().count().max(1), "the file holds no rays".to_owned()));
    }
    Ok(rays)
}

fn parse_ray(line: &str) -> Result<Ray, String> {
    let fields: Vec<&str> = line.split(',').map(str::trim).collect();
    if !(6..=7).contains(&fields.len()) {
        return Err(format!("{} numbers, expected 6 or 7: ox,oy,oz,dx,dy,dz[,t_max]", fields.len()));
    }
    let mut x = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, f64::INFINITY];
    const NAMES: [&str; 7] = ["ox", "oy", "oz", "dx", "dy", "dz", "t_max"];
    for (k, field) in fields.iter().enumerate() {
        x[k] = match field.parse::<f64>() {
            Ok(value) if value.is_finite() || (k == 6 && value == f64::INFINITY) => value,
            _ => return Err(format!("{} is '{field}', expected a finite number", NAMES[k])),
        };
    }
    let dir = DVec3::new(x[3], x[4], x[5]);
    if dir == DVec3::ZERO {
        return Err("the direction is zero".to_owned());
    }
    if !DIRECTION_LENGTHS.contains(&dir.abs().max_element()) {
        return Err(format!(
            "the direction is {}, expected a largest component of 1e-60 to 1e60",
            vector(dir)
        ));
    }
    let origin = DVec3::new(x[0], x[1], x[2]);
    if origin.abs().max_element() > MAX_COORDINATE_M {
        return Err(format!("the origin is {}, expected coordinates within -1e6 to 1e6 m", vector(origin)));
    }
    if x[6] <= 0.0 {
        return Err(format!("t_max is {}, expected more than 0", x[6]));
    }
    Ok(Ray { t_max: x[6], ..Ray::unbounded(origin, dir) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_with_comments_and_optional_t_max_are_read_in_order() {
        let rays = parse_rays("# eye rays\n0,0,0, 0,0,1\n\n1,2,3,1,0,0,2.5\r\n").unwrap();
        assert_eq!(rays.len(), 2);
        assert_eq!(rays[0], Ray::unbounded(DVec3::ZERO, DVec3::Z));
        assert_eq!((rays[1].origin, rays[1].t_max), (DVec3::new(1.0, 2.0, 3.0), 2.5));
    }

    #[test]
    fn rays_with_a_fault_name_line_and_value() {
        let cases = [
            ("0,0,0,0,0,1\n0,0,0,0,0", 2, "5 numbers"),
            ("\n\n0,0,x,0,0,1", 3, "oz is 'x'"),
            ("0,0,0,0,nan,1", 1, "dy is 'nan'"),
            ("0,0,0,0,0,0", 1, "direction is zero"),
            ("0,0,0,0,0,1\n0,0,0,1e-300,0,0", 2, "direction is 1e-300, 0, 0"),
            ("0,0,0,0,-1e61,0", 1, "direction is 0, -1e61, 0"),
            ("0,0,0,0,inf,0", 1, "dy is 'inf'"),
            ("0,2e6,0,0,1,0", 1, "origin is 0, 2000000, 0"),
            ("0,0,0,0,0,1,-1", 1, "t_max is -1"),
            ("# nothing\n", 1, "no rays"),
            ("", 1, "no rays"),
        ];
        for (text, line, what) in cases {
            let (at, message) = parse_rays(text).unwrap_err();
            assert_eq!(at, line, "{text:?}");
            assert!(message.contains(what), "{text:?}: {message}");
        }
    }
}
