//! `[[continuity]]`: what holds between two surfaces whatever their smooth groups and normals say.

use std::collections::HashMap;
use std::ops::Range;

use toml::Spanned;

use super::super::error::line_column;
use super::super::{Continuity, Scene, SceneError, Surface, SurfaceContinuity, SurfaceId};
use super::faults::suggest;
use super::raw::RawContinuity;
use super::source::Source;
use super::value::Table;
use crate::mesh::Mesh;

/// The entries resolved, and the place of each one's `between`.
pub(super) struct Entries {
    pub(super) list: Vec<SurfaceContinuity>,
    places: Vec<Range<usize>>,
}

pub(super) fn resolve(
    source: &Source<'_>,
    raw: Vec<Spanned<Table<RawContinuity>>>,
    surfaces: &[Surface],
) -> Result<Entries, SceneError> {
    let mut entries = Entries { list: Vec::new(), places: Vec::new() };
    if raw.is_empty() {
        return Ok(entries);
    }
    let by_name: HashMap<&str, SurfaceId> =
        surfaces.iter().enumerate().map(|(i, s)| (s.name.as_str(), SurfaceId(i as u32))).collect();
    let mut first_use: HashMap<[SurfaceId; 2], usize> = HashMap::new();
    for entry in raw {
        let Table(entry) = entry.into_inner();
        let place = entry.between.span();
        let named = |name: &Spanned<String>| {
            by_name.get(name.get_ref().as_str()).copied().ok_or_else(|| {
                let given = name.get_ref();
                let fault =
                    source.fault(name.span(), format!("unknown surface {given:?}, expected its name"));
                suggest(fault, given, surfaces.iter().map(|s| s.name.as_str()))
            })
        };
        let [a, b] = &entry.between.get_ref().0;
        let (one, other) = (named(a)?, named(b)?);
        let pair = || format!("{:?} and {:?}", a.get_ref(), b.get_ref());
        if one == other {
            let message = format!("continuity between {}, expected two different surfaces", pair());
            return Err(source.fault(place, message));
        }
        let between = [one.min(other), one.max(other)];
        if let Some(first) = first_use.insert(between, place.start) {
            let (line, _) = line_column(source.text, first);
            let message =
                format!("a second continuity between {}, expected one a pair (first: line {line})", pair());
            return Err(source.fault(place, message));
        }
        let continuity = continuity(source, &entry.is)?;
        entries.list.push(SurfaceContinuity { between, continuity });
        entries.places.push(place);
    }
    Ok(entries)
}

fn continuity(source: &Source<'_>, is: &Spanned<String>) -> Result<Continuity, SceneError> {
    let all = [Continuity::C1, Continuity::C0, Continuity::Broken];
    all.into_iter().find(|c| c.name() == is.get_ref()).ok_or_else(|| {
        let message = format!("continuity {:?}, expected \"C1\", \"C0\" or \"C-1\"", is.get_ref());
        source.fault(is.span(), message)
    })
}

/// Refuses entries whose surfaces do not meet.
pub(super) fn check_edges(source: &Source<'_>, scene: &Scene, places: &Entries) -> Result<(), SceneError> {
    if scene.continuity.is_empty() {
        return Ok(());
    }
    let Some(&first) = Mesh::continuity_without_edge(scene).first() else { return Ok(()) };
    let [a, b] = scene.continuity[first].between.map(|s| scene.surfaces[s.0 as usize].name.as_str());
    let message = format!(
        "surfaces {a:?} and {b:?} share no edge, expected two with an edge between the same corners and their fronts on one \
         side of it"
    );
    Err(source.fault(places.places[first].clone(), message))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::parse;
    use super::*;

    const BASE: &str = "version = 1\n[materials.wall]\nreflectance = 0.5\nemission = 1\n\
        [[surface]]\nname = \"floor\"\nmaterial = \"wall\"\nquad = [[0,0,0],[1,0,0],[1,1,0],[0,1,0]]\n\
        [[surface]]\nname = \"rug\"\nmaterial = \"wall\"\nquad = [[1,0,0],[2,0,0],[2,1,0],[1,1,0]]\n\
        [[surface]]\nname = \"under\"\nmaterial = \"wall\"\nquad = [[1,0,0],[1,1,0],[2,1,0],[2,0,0]]\n";

    fn with(entries: &str) -> Result<Scene, SceneError> {
        parse(&format!("{BASE}{entries}"), Path::new("scene.toml"))
    }

    #[test]
    fn continuity_of_two_surfaces_is_read_whichever_is_named_first() {
        let between = [SurfaceId(0), SurfaceId(1)];
        for (name, continuity) in
            [("C1", Continuity::C1), ("C0", Continuity::C0), ("C-1", Continuity::Broken)]
        {
            for names in ["\"floor\", \"rug\"", "\"rug\", \"floor\""] {
                let scene = with(&format!("[[continuity]]\nbetween = [{names}]\nis = \"{name}\"\n")).unwrap();
                assert_eq!(scene.continuity, [SurfaceContinuity { between, continuity }]);
            }
        }
        assert!(with("").unwrap().continuity.is_empty());
    }

    #[test]
    fn surfaces_that_look_opposite_ways_along_their_edge_have_none_to_join() {
        let error = with("[[continuity]]\nbetween = [\"floor\", \"under\"]\nis = \"C1\"\n").unwrap_err();
        assert!(error.to_string().contains("fronts on one side"), "{error}");
    }
}
