//! What holds for every kind, and the shipped scenes against the commands in their first lines.

use std::path::Path;

use glam::{IVec2, IVec3};
use proptest::prelude::*;

use super::furnished_room::{Furnished, furnish};
use super::furniture::{Block, Face, Piece};
use super::text::Quad;
use super::*;
use crate::geom::DVec3;
use crate::scene::{Scene, Shape};

fn made(kind: Kind, count: u32, seed: u64) -> (String, Scene) {
    let generated = generate(kind, count, seed).unwrap();
    let scene = Scene::parse(&generated.text, Path::new("scene.toml")).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(scene.surfaces.len(), generated.n_surfaces);
    (generated.text, scene)
}

fn corners(scene: &Scene) -> impl Iterator<Item = (&str, [DVec3; 4])> {
    scene.surfaces.iter().map(|s| match s.shape {
        Shape::Quad(corners) => (s.name.as_str(), corners),
        _ => panic!("{} is no quad", s.name),
    })
}

fn is_room(name: &str) -> bool {
    ["floor", "wall-", "ceiling-", "lamp-"].iter().any(|part| name.starts_with(part))
}

/// Things that were asked for: patches, segments, lamps, or pieces, whose surfaces are `table-3-top-left` and the like.
fn n_things(kind: Kind, scene: &Scene) -> usize {
    if kind == Kind::ManyLamps {
        return scene.surfaces.iter().filter(|s| !s.exitance.is_black()).count();
    }
    let name = |s: &str| s.split('-').take(2).collect::<Vec<_>>().join("-");
    let mut names: Vec<String> =
        scene.surfaces.iter().filter(|s| !is_room(&s.name)).map(|s| name(&s.name)).collect();
    names.dedup();
    names.len()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn scene_of_any_kind_count_and_seed_loads_and_has_what_was_asked_for(
        kind in prop::sample::select(&Kind::ALL[..]), count in 1_u32..80, seed: u64
    ) {
        let (_, scene) = made(kind, count, seed);
        prop_assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        prop_assert!(scene.camera.is_some());
        prop_assert_eq!(n_things(kind, &scene), count as usize);
        prop_assert!(scene.surfaces.iter().any(|s| !s.exitance.is_black()));
    }

    #[test]
    fn room_of_any_kind_is_closed_and_its_fronts_look_inward(
        kind in prop::sample::select(&Kind::ALL[..]), count in 1_u32..80, seed: u64
    ) {
        let (_, scene) = made(kind, count, seed);
        let (mut six_volumes, mut area, mut far) = (0.0, DVec3::ZERO, DVec3::ZERO);
        for (_, p) in corners(&scene).filter(|(name, _)| is_room(name)) {
            for [b, c] in [[p[1], p[2]], [p[2], p[3]]] {
                six_volumes += p[0].dot(b.cross(c));
                area += (b - p[0]).cross(c - p[0]);
                far = far.max(b).max(c);
            }
        }
        let volume = far.x * far.y * far.z;
        prop_assert!(volume > 0.0 && (six_volumes + 6.0 * volume).abs() < 1e-6 * volume, "{six_volumes}");
        prop_assert!(area.length() < 1e-9 * far.length_squared(), "{area}");
        // What stands in the room stays in it, and so does the camera.
        let eye = scene.camera.unwrap().eye;
        for (name, p) in corners(&scene).chain([("camera", [eye; 4])]) {
            for p in p {
                prop_assert!(p.cmpge(DVec3::ZERO).all() && p.cmple(far).all(), "{name}: {p}");
            }
        }
    }

    #[test]
    fn pieces_of_a_furnished_room_stand_apart_from_each_other_the_walls_and_the_camera(
        count in 1_u32..60, seed: u64
    ) {
        let Furnished { room, pieces } = furnish(count, seed);
        prop_assert_eq!(pieces.len(), count as usize);
        let prints: Vec<[IVec2; 2]> = pieces.iter().map(Piece::footprint).collect();
        for (i, [low, high]) in prints.iter().enumerate() {
            prop_assert!(low.cmpge(IVec2::splat(20_000)).all(), "{}", pieces[i].name);
            prop_assert!(high.cmple(room.size.truncate() - 20_000).all(), "{}", pieces[i].name);
            // The eye is at (0.3, 0.3).
            prop_assert!(low.max_element() > 600_000, "{} stands at the camera", pieces[i].name);
            for (j, [other_low, other_high]) in prints.iter().enumerate().take(i) {
                let apart = high.cmplt(*other_low).any() || other_high.cmplt(*low).any();
                prop_assert!(apart, "{} and {}", pieces[i].name, pieces[j].name);
            }
        }
    }

    #[test]
    fn blocks_of_a_piece_share_no_space_and_no_face_lies_on_another(count in 8_u32..40, seed: u64) {
        for piece in furnish(count, seed).pieces {
            for (i, a) in piece.blocks.iter().enumerate() {
                prop_assert!(a.low.cmplt(a.high).all() && a.low.z >= 0);
                for b in &piece.blocks[..i] {
                    let shared = a.high.min(b.high) - a.low.max(b.low);
                    prop_assert!(shared.min_element() <= 0, "{}: {a:?} {b:?}", piece.name);
                    for (f, g) in a.faces.iter().flat_map(|f| b.faces.iter().map(move |g| (*f, *g))) {
                        prop_assert!(!overlap(a.corners(f), b.corners(g)), "{}: {a:?} {f:?} {b:?} {g:?}", piece.name);
                    }
                }
                prop_assert!(a.low.z > 0 || !a.faces.contains(&Face::Bottom), "{}: on the floor", piece.name);
            }
        }
    }

    #[test]
    fn faces_of_a_piece_look_away_from_their_block_however_it_is_turned(count in 8_u32..40, seed: u64) {
        for piece in furnish(count, seed).pieces {
            let mut quads = piece.quads();
            for block in &piece.blocks {
                let one = Piece { blocks: vec![whole(block)], ..piece.clone() };
                let all: Vec<IVec3> = one.quads().flat_map(|q| q.corners).collect();
                let middle = all.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / all.len() as f64;
                for _ in block.faces {
                    let Quad { name, corners, .. } = quads.next().unwrap();
                    let [a, b, c, d] = corners.map(|p| p.as_dvec3());
                    let normal = (b - a).cross(c - a);
                    prop_assert!(normal.dot(a - middle) > 0.0, "{name}");
                    // Turned corners are whole: a rectangle stays a rectangle to the last digit.
                    prop_assert_eq!((b - a).dot(d - a), 0.0);
                    prop_assert_eq!(b - a, c - d);
                }
            }
            prop_assert!(quads.next().is_none());
        }
    }

    #[test]
    fn segments_stand_upright_over_the_whole_height_and_the_camera_is_in_the_middle_plane(
        count in 1_u32..200, seed: u64
    ) {
        let (_, scene) = made(Kind::Segments2d, count, seed);
        let height = corners(&scene).flat_map(|(_, p)| p).map(|p| p.z).fold(0.0, f64::max);
        let camera = scene.camera.unwrap();
        prop_assert_eq!([2.0 * camera.eye.z, 2.0 * camera.target.z], [height; 2]);
        let walls = ["segment-", "wall-"];
        for (name, [a, b, c, d]) in corners(&scene).filter(|(name, _)| walls.iter().any(|w| name.starts_with(w))) {
            let mut z = [a.z, b.z, c.z, d.z];
            z.sort_by(f64::total_cmp);
            prop_assert_eq!(z, [0.0, 0.0, height, height], "{}", name);
            let ground = |z: f64| [a, b, c, d].into_iter().filter(move |p| p.z == z).map(|p| p.truncate());
            prop_assert!(ground(0.0).all(|p| ground(height).any(|q| p == q)), "{name}");
        }
    }
}

/// A block with all its faces.
fn whole(block: &Block) -> Block {
    let faces = &[Face::Left, Face::Right, Face::Front, Face::Back, Face::Bottom, Face::Top];
    Block { faces, ..block.clone() }
}

/// Two axis-parallel rectangles in one plane that share an area.
fn overlap(a: [IVec3; 4], b: [IVec3; 4]) -> bool {
    let [a, b] = [a, b].map(|p| [p[0].min(p[2]), p[0].max(p[2])]);
    let shared = a[1].min(b[1]) - a[0].max(b[0]);
    let flat = |r: [IVec3; 2]| (r[1] - r[0]).cmpeq(IVec3::ZERO);
    flat(a) == flat(b)
        && shared.to_array().iter().filter(|s| **s > 0).count() == 2
        && shared.min_element() == 0
}

#[test]
fn scene_of_equal_seed_is_the_same_bytes_and_of_another_seed_is_not() {
    for kind in Kind::ALL {
        let text = |seed| generate(kind, 20, seed).unwrap().text;
        assert_eq!(text(1), text(1), "{kind}");
        let strip =
            |text: String| text.lines().filter(|l| !l.starts_with('#')).collect::<Vec<_>>().join("\n");
        assert_ne!(strip(text(1)), strip(text(2)), "{kind}");
    }
}

#[test]
fn count_outside_its_kinds_range_is_refused_and_the_largest_loads() {
    for kind in Kind::ALL {
        for count in [0, kind.max_count() + 1] {
            let e = generate(kind, count, 1).unwrap_err();
            assert_eq!(e, CountError { kind, count });
            assert_eq!(
                e.to_string(),
                format!("count {count}: expected 1 to {} for {kind}", kind.max_count())
            );
        }
        let (_, scene) = made(kind, kind.max_count(), u64::MAX);
        assert_eq!(n_things(kind, &scene), kind.max_count() as usize);
    }
}

#[test]
fn random_patches_keep_off_the_walls_and_out_of_the_cameras_face() {
    for count in [1, 500, 20_000] {
        let (_, scene) = made(Kind::RandomPatches, count, 9);
        let eye = scene.camera.unwrap().eye;
        let far = DVec3::new(4.0, 4.0, 3.0);
        let mut n = 0;
        for (name, p) in corners(&scene).filter(|(name, _)| name.starts_with("patch-")) {
            n += 1;
            for p in p {
                assert!((p - 0.01).min_element() > -1e-9 && (far - 0.01 - p).min_element() > -1e-9, "{name}");
                assert!(p.distance(eye) > 0.5, "{name}");
            }
        }
        assert_eq!(n, count);
    }
}

#[test]
fn furnished_rooms_have_every_design_and_turned_pieces() {
    let pieces = furnish(200, 1).pieces;
    for design in ["table-", "chair-", "shelf-", "cupboard-"] {
        let n = pieces.iter().filter(|p| p.name.starts_with(design)).count();
        assert!(n >= 5, "{n} {design}");
    }
    let slanted = |q: &Quad| (q.corners[1] - q.corners[0]).to_array().iter().filter(|c| **c != 0).count() > 1;
    assert!(pieces.iter().filter(|p| p.quads().any(|q| slanted(&q))).count() > 20);
}

#[test]
fn shipped_scenes_are_what_the_command_in_their_first_lines_makes() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for (kind, count) in [(Kind::RandomPatches, 500), (Kind::FurnishedRoom, 12)] {
        let shipped = std::fs::read_to_string(scenes.join(kind.name()).join("scene.toml")).unwrap();
        assert!(
            shipped == generate(kind, count, 1).unwrap().text,
            "scenes/{kind}/scene.toml differs: make it again with --force"
        );
    }
}
