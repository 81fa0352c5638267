//! `[[surface]]`: one shape each, a unique name, a known material, and its exitance in W/m^2.

use std::collections::HashMap;

use toml::Spanned;

use super::super::{SceneError, Shape, Surface};
use super::faults::suggest;
use super::geometry::{self, GeometryFault};
use super::materials::Materials;
use super::raw::RawSurface;
use super::source::Source;
use super::value::{MAX_LIGHT, Table, Vector};

pub(super) fn resolve(
    source: &Source<'_>,
    raw: Vec<Spanned<Table<RawSurface>>>,
    materials: &Materials,
) -> Result<Vec<Surface>, SceneError> {
    let mut first_use = HashMap::with_capacity(raw.len());
    let mut surfaces = Vec::with_capacity(raw.len());
    for raw in raw {
        let span = raw.span();
        let Table(raw) = raw.into_inner();
        let name = raw.name.get_ref();
        if name.is_empty() {
            return Err(source.fault(raw.name.span(), "an empty name, expected one that tells the surface"));
        }
        if let Some(other) = first_use.insert(name.clone(), raw.name.span()) {
            let (line, _) = super::super::error::line_column(source.text, other.start);
            let message =
                format!("a second surface named {name:?}, expected a unique name (first: line {line})");
            return Err(source.fault(raw.name.span(), message));
        }
        surfaces.push(surface(source, span, raw, materials)?);
    }
    Ok(surfaces)
}

fn surface(
    source: &Source<'_>,
    span: std::ops::Range<usize>,
    raw: RawSurface,
    materials: &Materials,
) -> Result<Surface, SceneError> {
    let wanted = raw.material.get_ref();
    let Some(&material) = materials.by_name.get(wanted) else {
        let message = format!("unknown material {wanted:?}, expected a table [materials.{wanted}]");
        let fault = source.fault(raw.material.span(), message);
        return Err(suggest(fault, wanted, materials.list.iter().map(|m| m.name.as_str())));
    };
    let shape = shape(source, span, &raw)?;
    let n_sides = if raw.two_sided { 2 } else { 1 };
    let area_m2 = shape.area_m2();
    let exitance = materials.emission[material.0 as usize].exitance(area_m2, n_sides);
    let largest = exitance.max_channel();
    if largest.is_nan() || largest > MAX_LIGHT {
        let message = format!(
            "surface {:?} of {area_m2:e} m^2 would emit {largest:e} W/m^2, expected at most {MAX_LIGHT:e}",
            raw.name.get_ref()
        );
        return Err(source.fault(raw.material.span(), message));
    }
    Ok(Surface {
        name: raw.name.into_inner(),
        material,
        shape,
        two_sided: raw.two_sided,
        smooth_group: raw.smooth_group.map_or(0, |g| g.0),
        exitance,
    })
}

/// The one shape of a surface, checked.
fn shape(source: &Source<'_>, table: std::ops::Range<usize>, raw: &RawSurface) -> Result<Shape, SceneError> {
    let given: Vec<_> = [
        ("quad", raw.quad.as_ref().map(Spanned::span)),
        ("triangle", raw.triangle.as_ref().map(Spanned::span)),
        ("disk", raw.disk.as_ref().map(Spanned::span)),
        ("sphere", raw.sphere.as_ref().map(Spanned::span)),
        ("cylinder", raw.cylinder.as_ref().map(Spanned::span)),
    ]
    .into_iter()
    .filter_map(|(key, span)| span.map(|s| (key, s)))
    .collect();
    let name = raw.name.get_ref();
    let all = "quad, triangle, disk, sphere, cylinder";
    if let [(first, _), (second, span), ..] = &given[..] {
        let message = format!("surface {name:?} is a {first} and a {second}, expected one shape of {all}");
        return Err(source.fault(span.clone(), message));
    }
    let points = |vectors: &[Vector]| vectors.iter().map(|v| v.to_dvec3()).collect::<Vec<_>>();
    let place = |span: std::ops::Range<usize>| {
        move |fault: GeometryFault| {
            let error = source.fault(span, format!("surface {name:?}: {}", fault.message));
            match fault.help {
                Some(help) => error.with_help(help),
                None => error,
            }
        }
    };
    if let Some(quad) = &raw.quad {
        let p = points(&quad.get_ref().0);
        return geometry::quad([p[0], p[1], p[2], p[3]]).map_err(place(quad.span()));
    }
    if let Some(triangle) = &raw.triangle {
        let p = points(&triangle.get_ref().0);
        return geometry::triangle([p[0], p[1], p[2]]).map_err(place(triangle.span()));
    }
    if let Some(disk) = &raw.disk {
        let Table(d) = disk.get_ref();
        return geometry::disk(d.center.to_dvec3(), d.normal.get_ref().to_dvec3(), d.radius.0)
            .map_err(place(d.normal.span()));
    }
    if let Some(sphere) = &raw.sphere {
        let Table(s) = sphere.get_ref();
        return geometry::sphere(s.center.to_dvec3(), s.radius.0, s.inward).map_err(place(sphere.span()));
    }
    if let Some(cylinder) = &raw.cylinder {
        let Table(c) = cylinder.get_ref();
        return geometry::cylinder(c.base.to_dvec3(), c.top.get_ref().to_dvec3(), c.radius.0, c.inward)
            .map_err(place(c.top.span()));
    }
    Err(source.fault(table, format!("surface {name:?} has no shape, expected one of {all}")))
}
