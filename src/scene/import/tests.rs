//! Model files in the small: every way to write a face, a normal, a material.

use std::f64::consts::PI;
use std::path::Path;

use glam::DVec3;

use super::*;
use crate::scene::Scene;

fn model(files: &[(&str, &[u8])]) -> Result<Model, SceneError> {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    load(&folder.path().join(files[0].0), folder.path(), false)
}

fn obj(text: &str) -> Model {
    model(&[("m.obj", text.as_bytes())]).unwrap()
}

/// Corners of all polygons of an object, with their arities.
fn polygons(object: &Object) -> Vec<Vec<DVec3>> {
    let faces = &object.faces;
    let mut corners = faces.corners.iter().map(|&c| faces.points[c as usize]);
    (0..faces.n_polygons())
        .map(|i| corners.by_ref().take(faces.arities.get(i).map_or(3, |&n| n as usize)).collect())
        .collect()
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn obj_faces_by_positive_negative_and_continued_indices_are_the_same() {
    let expected = polygons(&obj(&format!("{SQUARE}f 1 2 3 4\n")).objects[0]);
    assert_eq!(expected[0].len(), 4);
    for face in [
        "f -4 -3 -2 -1\n",
        "f 1 2 \\\n  3 4 # a comment\n",
        "vt 0 0\nf 1/1 2/1 3/-1 4/1\n",
        "vn 0 0 1\nf 1//1 2//1 3//1 4//-1\r\n",
    ] {
        assert_eq!(polygons(&obj(&format!("{SQUARE}{face}")).objects[0]), expected, "{face}");
    }
    // A face may stand before its points; lines and colors are left out.
    let turned = format!("f 1 2 3 4\nl 1 2\n{}", SQUARE.replace("1 1 0", "1 1 0 0.5 0.5 0.5"));
    let turned = obj(&turned);
    assert_eq!(polygons(&turned.objects[0]), expected);
    assert!(
        turned.warnings.iter().any(|w| w.contains("left out") && w.contains("'lines'")),
        "{:?}",
        turned.warnings
    );
}

#[test]
fn obj_objects_and_materials_make_one_object_each_however_often_they_alternate() {
    let mtl = b"newmtl a\nKd 0.1 0.1 0.1\nnewmtl b\nKd 0.2 0.2 0.2\n";
    let text = format!(
        "mtllib m.mtl\n{SQUARE}o one\nusemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\nusemtl a\nf 1 2 4\no two\nf 2 3 4\n\
         o one\nusemtl b\nf 2 3 4\nusemtl missing\nf 1 2 3\n"
    );
    let model = model(&[("m.obj", text.as_bytes()), ("m.mtl", mtl)]).unwrap();
    let found: Vec<(&str, usize, usize)> =
        model.objects.iter().map(|o| (o.name.as_str(), o.material, o.faces.n_polygons())).collect();
    assert_eq!(found, [("one", 0, 2), ("one", 1, 2), ("two", 0, 1), ("one", 2, 1)]);
    assert_eq!(model.materials[2].material.reflectance, Rgb::splat(0.6));
    assert!(model.objects.iter().all(|o| o.two_sided));
}

#[test]
fn obj_smooth_groups_and_normals_reach_their_polygons_and_half_told_normals_count_as_none() {
    let text = format!("{SQUARE}vn 0 0 1\ns 3\nf 1 2 3\ns off\nf 1//1 3//1 4//1\nf 1//1 2//1 4\n");
    let faces = &obj(&text).objects[0].faces;
    assert_eq!(faces.groups, [3, 0, 0]);
    let has_normal: Vec<bool> = faces.corner_normals.iter().map(|&n| n != u32::MAX).collect();
    assert_eq!(has_normal, [false, false, false, true, true, true, false, false, false]);
}

#[test]
fn mtl_hints_of_mirror_glass_and_light_become_shares() {
    let mtl = b"newmtl mirror\nKd 0.1 0.1 0.1\nKs 0.8 0.7 0.6\nillum 3\nnewmtl pane\nKd 0.5 0.5 0.5\nd 0.25\nNi 1.4\n\
        newmtl glass\nKd 0 0 0\nTf 0.9 0.8 0.7\nillum 7\nnewmtl old\nKd 0.4\nTr 0.5\nnewmtl coat\nKd 0.5 0.5 0.5\n\
        Ks 0.5 0.5 0.5\nNs 250\nillum 2\nnewmtl metal\nKd 0.9 0.6 0.3\nPm 1\nPr 0.05\nnewmtl white\nKd 1 1 1\nKe 2 3 4\n";
    let text = format!("mtllib m.mtl\n{SQUARE}f 1 2 3\n");
    let model = model(&[("m.obj", text.as_bytes()), ("m.mtl", mtl)]).unwrap();
    let of = |name: &str| model.materials.iter().find(|m| m.material.name == name).unwrap();
    let shares = |name: &str| {
        let m = &of(name).material;
        [m.reflectance.0, m.specular.0, m.transmission.0]
    };
    assert_eq!(shares("mirror"), [[0.1; 3], [0.8, 0.7, 0.6], [0.0; 3]]);
    assert_eq!(shares("pane"), [[0.125; 3], [0.0; 3], [0.75; 3]]);
    assert_eq!(of("pane").material.ior, 1.4);
    assert_eq!(shares("glass"), [[0.0; 3], [0.0; 3], [0.9, 0.8, 0.7]]);
    assert_eq!(shares("old"), [[0.2; 3], [0.0; 3], [0.5; 3]]);
    assert_eq!(shares("coat"), [[0.5; 3], [0.0; 3], [0.0; 3]]);
    assert_eq!(shares("metal"), [[0.0; 3], [0.9, 0.6, 0.3], [0.0; 3]]);
    assert_eq!(shares("white"), [[0.95; 3], [0.0; 3], [0.0; 3]]);
    assert_eq!(of("white").exitance.0, [2.0, 3.0, 4.0]);
    let all = model.warnings.join("\n");
    assert!(all.contains("highlights") && all.contains("'coat'") && all.contains("scaled to 0.95"), "{all}");
}

#[test]
fn mtl_picture_becomes_its_mean_color_and_a_missing_one_is_told() {
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, 2, 1);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().unwrap().write_image_data(&[255, 0, 0, 255, 255, 0]).unwrap();
    let mtl = b"newmtl a\nKd 0.8 0.8 0.8\nmap_Kd -s 1 1 1 -clamp on a b.png\nnewmtl b\nKd 0.3 0.3 0.3\nmap_Kd none.png\n";
    let text = format!("mtllib m.mtl\n{SQUARE}f 1 2 3\n");
    let model = model(&[("m.obj", text.as_bytes()), ("m.mtl", mtl), ("a b.png", &png)]).unwrap();
    assert_eq!(model.materials[0].material.reflectance.0, [0.8, 0.4, 0.0]);
    assert_eq!(model.materials[1].material.reflectance.0, [0.3; 3]);
    let all = model.warnings.join("\n");
    assert!(
        all.contains("became its mean color: 'a'")
            && all.contains("none.png")
            && all.contains("no such file"),
        "{all}"
    );
}

/// A glTF of one mesh: its bytes as the only buffer, and these members.
fn gltf(bytes: &[u8], members: &str) -> Result<Model, SceneError> {
    use base64::Engine;
    let data = base64::engine::general_purpose::STANDARD.encode(bytes);
    let text = format!(
        r#"{{"asset": {{"version": "2.0"}}, "nodes": [{{"mesh": 0}}], {members},
            "buffers": [{{"uri": "data:application/octet-stream;base64,{data}", "byteLength": {}}}]}}"#,
        bytes.len()
    );
    model(&[("m.gltf", text.as_bytes())])
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

#[test]
fn gltf_strips_and_fans_wind_as_lists_do() {
    // A strip 0 1 2 3 is (0 1 2) (1 3 2), its points in a zigzag; all face +z.
    let zigzag = floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0., 0., 2., 0.]);
    let around = floats(&[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., -1., 0.5, 0.]);
    for (mode, bytes) in [(5, zigzag), (6, around)] {
        let members = format!(
            r#""meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "mode": {mode}}}]}}],
               "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3"}}],
               "bufferViews": [{{"buffer": 0, "byteLength": 60}}]"#
        );
        let model = gltf(&bytes, &members).unwrap();
        let triangles = polygons(&model.objects[0]);
        assert_eq!(triangles.len(), 3);
        assert!(triangles.iter().all(|t| (t[1] - t[0]).cross(t[2] - t[0]).z > 0.0), "{mode}: {triangles:?}");
    }
}

#[test]
fn gltf_quantised_interleaved_positions_are_read_by_their_stride() {
    // Normalised signed bytes, three of eight bytes each.
    let mut bytes = Vec::new();
    for [x, y, z] in [[0_i8, 0, 0], [127, 0, 0], [0, 127, -128]] {
        bytes.extend([x, y, z].map(|c| c as u8));
        bytes.extend([99; 5]);
    }
    let members = r#""extensionsRequired": ["KHR_mesh_quantization"],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5120, "normalized": true, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 24, "byteStride": 8}]"#;
    let model = gltf(&bytes, members).unwrap();
    let v = DVec3::new;
    assert_eq!(polygons(&model.objects[0]), [vec![v(0., 0., 0.), v(1., 0., 0.), v(0., 1., -1.)]]);
}

#[test]
fn gltf_materials_by_default_metal_glass_and_light() {
    let bytes = floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
    let primitives: Vec<String> =
        (0..6).map(|m| format!(r#"{{"attributes": {{"POSITION": 0}}, "material": {m}}}"#)).collect();
    let materials = r#"{}, {"name": "mirror", "pbrMetallicRoughness": {"baseColorFactor": [0.9, 0.8, 0.7, 1], "roughnessFactor": 0.05}},
        {"name": "half", "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.8, 0.8, 1], "metallicFactor": 0.25, "roughnessFactor": 0}},
        {"name": "glass", "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.75}, "KHR_materials_ior": {"ior": 1.3}},
         "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.8, 0.8, 1], "metallicFactor": 0, "roughnessFactor": 0}},
        {"name": "lamp", "emissiveFactor": [1, 0.5, 0], "doubleSided": true, "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 1790}}},
        {"name": "veil", "alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 0.25], "metallicFactor": 0}}"#;
    let members = format!(
        r#""meshes": [{{"primitives": [{}]}}], "materials": [{materials}],
           "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}}],
           "bufferViews": [{{"buffer": 0, "byteLength": 36}}]"#,
        primitives.join(", ")
    );
    let model = gltf(&bytes, &members).unwrap();
    let near = |found: Rgb, expected: [f64; 3]| {
        assert!(found.0.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?} {expected:?}");
    };
    let m = |i: usize| &model.materials[i].material;
    near(m(0).reflectance, [0.95; 3]);
    near(m(1).specular, [0.9, 0.8, 0.7]);
    near(m(1).reflectance, [0.0; 3]);
    near(m(2).specular, [0.2; 3]);
    near(m(2).reflectance, [0.6; 3]);
    near(m(3).transmission, [0.6; 3]);
    near(m(3).reflectance, [0.2; 3]);
    assert!((m(3).ior - 1.3).abs() < 1e-6);
    near(model.materials[4].exitance, [10.0 * PI, 5.0 * PI, 0.0]);
    near(m(5).transmission, [0.75; 3]);
    near(m(5).reflectance, [0.125; 3]);
    let sides: Vec<bool> = model.objects.iter().map(|o| o.two_sided).collect();
    assert_eq!(sides, [false, false, false, false, true, false]);
    assert!(
        model.warnings.iter().any(|w| w.contains("rough metal") && w.contains("'material 0'")),
        "{:?}",
        model.warnings
    );
}

#[test]
fn camera_added_to_a_model_sees_all_of_its_box_and_stands_inside_a_room() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.obj");
    let points = "v 0 0 0\nv 9 0 0\nv 9 2 0\nv 0 2 0\nv 0 0 3\nv 9 0 3\nv 9 2 3\nv 0 2 3\n";
    let out = "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    let inward = "f 1 2 3 4\nf 8 7 6 5\nf 5 6 2 1\nf 6 7 3 2\nf 7 8 4 3\nf 8 5 1 4\n";
    let scene = |faces: &str, path: &Path| {
        std::fs::write(path, format!("{points}{faces}")).unwrap();
        Scene::load(path).unwrap()
    };
    let camera = scene(out, &path).camera.unwrap();
    let view = (camera.target - camera.eye).normalize();
    let right = view.cross(camera.up).normalize();
    let up = right.cross(view);
    let tan = (0.5 * camera.fov_y_deg).to_radians().tan();
    let mut largest = 0.0_f64;
    for i in 0..8 {
        let corner = DVec3::new([0., 9.][i & 1], [0., 2.][i >> 1 & 1], [0., 3.][i >> 2]) - camera.eye;
        let depth = corner.dot(view);
        assert!(depth > 0.0);
        largest =
            largest.max((corner.dot(right).abs() / depth / tan).max(corner.dot(up).abs() / depth / tan));
    }
    assert!(largest < 1.0 && largest > 0.85, "{largest}");
    let room = scene(inward, &path);
    let eye = room.camera.unwrap().eye;
    assert!(eye.cmpgt(DVec3::ZERO).all() && eye.cmplt(DVec3::new(9.0, 2.0, 3.0)).all(), "{eye}");
    assert!(matches!(room.lights[..], [crate::scene::Light::Point { .. }]));
}
