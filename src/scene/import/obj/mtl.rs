//! Material libraries: checked line by line, read by tobj, and turned into what the solver knows.
//!
//! ```text
//! Kd (x the mean of map_Kd)          diffuse reflectance
//! Ke (x the mean of map_Ke)          exitance M (W/m^2), as `emission` in a scene file
//! illum 3 or 5, Ks                   mirror; Pm > 0 with Pr <= 0.1 likewise, of color Kd
//! illum 4, 6, 7, 9, or d < 1 (Tr)    glass: transmission 1 - d, or Tf where d is 1, and Ni
//! ```
//! Ks and Ns of other illumination models are the highlight of a lamp on a glossy coat: left out, with a warning. A
//! rough mirror (Pm with Pr between 0.1 and 0.5) is refused.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use super::clean::Lines;
use super::{files, referred};
use crate::scene::import::texture::{self, Coding};
use crate::scene::import::{ModelMaterial, Notes, bounded};
use crate::scene::{Material, SceneError};
use crate::units::Rgb;

/// Largest exitance of a file (W/m^2): as in scene files.
const MAX_EXITANCE: f64 = 1e12;

/// The libraries of a model.
pub(super) struct Libraries {
    folder: PathBuf,
    /// Read for the names only.
    undressed: bool,
    /// Each with the library that it stands in.
    materials: Vec<(tobj::Material, PathBuf)>,
    missing: Vec<String>,
    fault: Option<SceneError>,
}

impl Libraries {
    pub(super) fn new(folder: &Path, undressed: bool) -> Libraries {
        Libraries {
            folder: folder.to_owned(),
            undressed,
            materials: Vec::new(),
            missing: Vec::new(),
            fault: None,
        }
    }

    /// Loads `mtllib name`: a name with spaces, or several names.
    pub(super) fn load(&mut self, model: &Path, name: &Path) -> tobj::MTLLoadResult {
        let name = name.to_string_lossy().into_owned();
        let mut list = Vec::new();
        let mut by_name = HashMap::new();
        let names: Vec<String> = match referred(&self.folder, model, &name) {
            Ok(whole) if whole.is_file() => vec![name],
            Ok(_) => name.split_whitespace().map(str::to_owned).collect(),
            Err(fault) => {
                self.fault.get_or_insert(fault);
                Vec::new()
            }
        };
        for name in names {
            match self.read(model, &name) {
                Ok(Some((file, materials))) => {
                    for material in materials {
                        by_name.insert(material.name.clone(), list.len());
                        list.push(material.clone());
                        self.materials.push((material, file.clone()));
                    }
                }
                Ok(None) => self.missing.push(name),
                Err(fault) => {
                    self.fault.get_or_insert(fault);
                }
            }
        }
        Ok((list, by_name))
    }

    fn read(&self, model: &Path, name: &str) -> Result<Option<(PathBuf, Vec<tobj::Material>)>, SceneError> {
        let file = referred(&self.folder, model, name)?;
        if !file.exists() {
            return Ok(None);
        }
        let bytes = files::read(&file, "a material library")?;
        let text = clean(&file, &String::from_utf8_lossy(&bytes))?;
        let (materials, _) = tobj::load_mtl_buf(&mut Cursor::new(text))
            .map_err(|e| SceneError::of_file(&file, format!("not a material library: {e}")))?;
        Ok(Some((file, materials)))
    }

    /// What the materials mean, in the order in which tobj numbers them; the first fault of a library.
    pub(super) fn finish(self, notes: &mut Notes) -> (Vec<ModelMaterial>, Option<SceneError>) {
        if self.fault.is_some() {
            return (Vec::new(), self.fault);
        }
        if self.undressed {
            return (vec![super::default_material(); self.materials.len()], None);
        }
        for name in &self.missing {
            notes.add("no such material library", name);
        }
        let mut textures = Textures { folder: &self.folder, means: HashMap::new() };
        let mut list = Vec::with_capacity(self.materials.len());
        for (material, file) in &self.materials {
            match resolve(material, file, &mut textures, notes) {
                Ok(material) => list.push(material),
                Err(fault) => return (Vec::new(), Some(fault)),
            }
        }
        (list, None)
    }
}

/// The statements that are read, checked: colors of three numbers from 0, numbers in their ranges.
fn clean(path: &Path, text: &str) -> Result<String, SceneError> {
    let mut out = String::new();
    for line in Lines::of(text) {
        let mut words = line.text.split_whitespace();
        let keyword = words.next().unwrap_or("");
        let rest = line.text.trim_start().get(keyword.len()..).unwrap_or("").trim();
        let fault = |message: String| line.fault(path, text, message);
        let number = |low: f64, high: f64| {
            let given = rest.split_whitespace().next().unwrap_or("");
            match given.parse::<f64>() {
                Ok(n) if n >= low && n <= high => Ok(n),
                _ => Err(fault(format!(
                    "`{keyword}` {:?}, expected a number from {low} to {high}",
                    super::shown(given)
                ))),
            }
        };
        match keyword {
            "newmtl" => {
                if rest.is_empty() {
                    return Err(fault("`newmtl` without a name".to_owned()));
                }
                let _ = writeln!(out, "newmtl {rest}");
            }
            "Kd" | "Ks" | "Ke" | "Tf" => {
                if matches!(words.clone().next(), Some("spectral" | "xyz")) {
                    return Err(fault(format!("`{keyword}` as a spectrum or xyz, expected r g b")));
                }
                let numbers = line.numbers(&mut words, keyword).map_err(&fault)?;
                let limit = if keyword == "Ke" { MAX_EXITANCE } else { 1e3 };
                let rgb = match numbers[..] {
                    [r] => [r, r, r],
                    [r, g, b] => [r, g, b],
                    _ => {
                        return Err(fault(format!(
                            "{} numbers of `{keyword}`, expected 1 or 3",
                            numbers.len()
                        )));
                    }
                };
                if let Some(bad) = rgb.iter().find(|c| !(0.0..=limit).contains(*c)) {
                    return Err(fault(format!("{bad} in `{keyword}`, expected 0 to {limit:e}")));
                }
                let _ = writeln!(out, "{keyword} {} {} {}", rgb[0], rgb[1], rgb[2]);
            }
            "d" => {
                // `d -halo 0.5`: more transparent where seen head on.
                let value = rest.strip_prefix("-halo").unwrap_or(rest).trim();
                let n = value.split_whitespace().next().unwrap_or("").parse::<f64>();
                match n {
                    Ok(n) if (0.0..=1.0).contains(&n) => {
                        let _ = writeln!(out, "d {n}");
                    }
                    _ => {
                        return Err(fault(format!(
                            "`d` {:?}, expected a number from 0 to 1",
                            super::shown(value)
                        )));
                    }
                }
            }
            "Tr" => {
                let _ = writeln!(out, "d {}", 1.0 - number(0.0, 1.0)?);
            }
            "Ni" => {
                let _ = writeln!(out, "Ni {}", number(0.0, 100.0)?);
            }
            "Pr" | "Pm" => {
                let _ = writeln!(out, "{keyword} {}", number(0.0, 1.0)?);
            }
            "illum" => {
                let _ = writeln!(out, "illum {}", number(0.0, 10.0)?.floor());
            }
            "map_Kd" | "map_Ke" if !rest.is_empty() => {
                let _ = writeln!(out, "{keyword} {rest}");
            }
            _ => {}
        }
    }
    Ok(out)
}

/// Means of pictures already read.
struct Textures<'a> {
    folder: &'a Path,
    means: HashMap<PathBuf, Result<Rgb, String>>,
}

impl Textures<'_> {
    /// The mean of the picture that `statement` names (after its options), white where it cannot be read.
    fn mean(
        &mut self,
        library: &Path,
        statement: &str,
        whose: &str,
        notes: &mut Notes,
    ) -> Result<Rgb, SceneError> {
        let name = file_of(statement);
        let file = referred(self.folder, library, name)?;
        let mean = self.means.entry(file).or_insert_with_key(|file| {
            if !file.exists() {
                return Err("no such file".to_owned());
            }
            let bytes = files::read(file, "a picture").map_err(|e| e.message)?;
            texture::mean(&bytes, Coding::Srgb)
        });
        Ok(match mean {
            Ok(mean) => {
                notes.add("a picture on a material became its mean color", whose);
                *mean
            }
            Err(why) => {
                notes.add(&format!("the picture {:?} is left out ({why})", super::shown(name)), whose);
                Rgb::WHITE
            }
        })
    }
}

/// The file name after options such as `-s 1 1 1` and `-clamp on`.
fn file_of(statement: &str) -> &str {
    let mut rest = statement.trim();
    while let Some(option) = rest.strip_prefix('-') {
        let name = option.split_whitespace().next().unwrap_or("");
        let mut tail = option[name.len()..].trim_start();
        let is_value = |w: &str| w.parse::<f64>().is_ok() || matches!(w, "on" | "off");
        while let Some(word) = tail.split_whitespace().next().filter(|w| is_value(w)) {
            tail = tail[word.len()..].trim_start();
        }
        rest = tail;
    }
    rest
}

fn resolve(
    given: &tobj::Material,
    library: &Path,
    textures: &mut Textures<'_>,
    notes: &mut Notes,
) -> Result<ModelMaterial, SceneError> {
    let name = given.name.clone();
    let unknown = |key: &str| given.unknown_param.get(key).map(String::as_str);
    let triple = |text: &str| {
        let mut numbers = text.split_whitespace().filter_map(|w| w.parse::<f64>().ok());
        Some(Rgb([numbers.next()?, numbers.next()?, numbers.next()?]))
    };
    let number = |key: &str| unknown(key).and_then(|t| t.parse::<f64>().ok()).unwrap_or(0.0);
    let or_black = |c: Option<[f64; 3]>| c.map_or(Rgb::BLACK, Rgb);
    let mut diffuse = given.diffuse.map_or(Rgb::splat(0.6), Rgb);
    if let Some(map) = &given.diffuse_texture {
        diffuse = diffuse * textures.mean(library, map, &name, notes)?;
    }
    let mut exitance = or_black(given.emissive);
    if let Some(map) = unknown("map_Ke") {
        exitance = exitance * textures.mean(library, map, &name, notes)?;
    }
    let illum = given.illumination_model.unwrap_or(2);
    let mut specular = Rgb::BLACK;
    let highlight = or_black(given.specular);
    if matches!(illum, 3 | 5) {
        specular = highlight;
    } else if highlight.max_channel() > 0.05 && !matches!(illum, 0 | 1 | 4 | 6 | 7 | 9) {
        notes.add("highlights (Ks, Ns without illum 3 or 5) are not modelled: diffuse only", &name);
    }
    let (metal, roughness) = (number("Pm"), unknown("Pr").map_or(1.0, |_| number("Pr")));
    if metal > 0.0 {
        let rough = crate::scene::import::metal(&name, metal, roughness, notes)
            .map_err(|message| SceneError::of_file(library, message))?;
        specular += diffuse * (metal * (1.0 - rough));
        diffuse = diffuse * (1.0 - metal * (1.0 - rough));
    }
    let mut transmission = Rgb::BLACK;
    let opacity = given.dissolve.unwrap_or(1.0);
    if opacity < 1.0 {
        transmission = Rgb::splat(1.0 - opacity);
        diffuse = diffuse * opacity;
    } else if matches!(illum, 4 | 6 | 7 | 9)
        && let Some(filter) = unknown("Tf").and_then(triple)
    {
        transmission = filter;
    }
    let ior = given.optical_density.filter(|n| *n >= 1.0).map_or(1.5, |n| n.min(10.0));
    let (material, scaled) =
        bounded(Material { name: name.clone(), reflectance: diffuse, specular, transmission, ior });
    if scaled {
        notes.add("reflects and transmits all light or more: scaled to 0.95 of it", &name);
    }
    Ok(ModelMaterial { material, exitance })
}
