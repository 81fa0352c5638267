//! Small models, valid and hostile, shared by the tests of importing.

#![allow(dead_code, reason = "each test that includes it uses a part")]

use std::path::{Path, PathBuf};

/// A closed room of 1 x 1 x 1 m, fronts inward, whose ceiling is a lamp of two triangles; all two-sided.
#[derive(Clone, Copy, Debug, Default)]
pub struct Room {
    /// The glTF node mirrors x, and so do its points.
    pub mirrored: bool,
    /// glTF only: with a point light in the middle.
    pub bulb: bool,
}

const CORNERS: [[f64; 3]; 8] = [
    [0., 0., 0.],
    [1., 0., 0.],
    [1., 1., 0.],
    [0., 1., 0.],
    [0., 0., 1.],
    [1., 0., 1.],
    [1., 1., 1.],
    [0., 1., 1.],
];

/// Floor and four walls, then the ceiling.
const FACES: [[usize; 4]; 6] =
    [[0, 1, 2, 3], [4, 5, 1, 0], [5, 6, 2, 1], [6, 7, 3, 2], [7, 4, 0, 3], [7, 6, 5, 4]];

impl Room {
    /// Writes it as `room.toml`, `room.obj`, `room.gltf` (with `room.bin`) and `room.glb`, in this order.
    pub fn write(&self, folder: &Path) -> Vec<PathBuf> {
        let file = |name: &str, bytes: &[u8]| {
            let path = folder.join(name);
            std::fs::write(&path, bytes).unwrap();
            path
        };
        file("room.mtl", self.mtl().as_bytes());
        file("room.bin", &self.buffer());
        vec![
            file("room.toml", self.toml().as_bytes()),
            file("room.obj", self.obj().as_bytes()),
            file("room.gltf", self.gltf(Some("room.bin")).as_bytes()),
            file("room.glb", &self.glb()),
        ]
    }

    pub fn toml(&self) -> String {
        let mut text = "version = 1\n[materials.wall]\nreflectance = [0.5, 0.4, 0.3]\n[materials.lamp]\n\
                        reflectance = 0.25\nemission = [4.0, 4.0, 4.0]\n"
            .to_owned();
        for (i, face) in FACES.iter().enumerate() {
            let name = if i == 5 { "lamp".to_owned() } else { format!("wall {i}") };
            let material = if i == 5 { "lamp" } else { "wall" };
            let corners = face.map(|c| CORNERS[c]);
            text += &format!(
                "[[surface]]\nname = \"{name}\"\nmaterial = \"{material}\"\ntwo_sided = true\nquad = {corners:?}\n"
            );
        }
        text
    }

    pub fn mtl(&self) -> String {
        "# two materials\nnewmtl wall\nKd 0.5 0.4 0.3\nillum 1\nnewmtl lamp\nKd 0.25 0.25 0.25\nKe 4 4 4\n"
            .to_owned()
    }

    pub fn obj(&self) -> String {
        let mut text = "# a room\nmtllib room.mtl\no room\n".to_owned();
        for [x, y, z] in CORNERS {
            text += &format!("v {x} {y} {z}\n");
        }
        text += "usemtl wall\ns off\n";
        for [a, b, c, d] in &FACES[..5] {
            text += &format!("f {} {} {} {}\n", a + 1, b + 1, c + 1, d + 1);
        }
        let [a, b, c, d] = FACES[5].map(|c| c + 1);
        text + &format!("usemtl lamp\nf {a} {b} {c}\nf {a} {c} {d}\n")
    }

    /// Positions of 24 corners (face by face), then indices of the walls and of the lamp.
    pub fn buffer(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for corner in FACES.iter().flatten() {
            let [x, y, z] = CORNERS[*corner];
            let x = if self.mirrored { 1.0 - x } else { x };
            bytes.extend([x, y, z].iter().flat_map(|c| (*c as f32).to_le_bytes()));
        }
        for face in 0..6_u16 {
            let order: [u16; 6] = if self.mirrored { [0, 2, 1, 0, 3, 2] } else { [0, 1, 2, 0, 2, 3] };
            bytes.extend(order.iter().flat_map(|c| (4 * face + c).to_le_bytes()));
        }
        bytes
    }

    pub fn gltf(&self, uri: Option<&str>) -> String {
        let uri = uri.map_or(String::new(), |u| format!(r#""uri": "{u}", "#));
        let node = if self.mirrored { r#""scale": [-1, 1, 1], "translation": [1, 0, 0], "# } else { "" };
        let candela = if self.bulb { 1790 } else { 0 };
        let strength = 4.0 * 179.0 / std::f64::consts::PI;
        format!(
            r#"{{
  "asset": {{"version": "2.0", "generator": "a test"}},
  "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_emissive_strength"],
  "extensions": {{"KHR_lights_punctual": {{"lights": [
    {{"type": "point", "color": [1, 0.5, 0], "intensity": {candela}}}
  ]}}}},
  "scene": 0,
  "scenes": [{{"nodes": [0, 1, 2]}}],
  "nodes": [
    {{{node}"mesh": 0, "name": "room"}},
    {{"name": "bulb", "translation": [0.5, 0.5, 0.5], "rotation": [0.6, 0, 0, 0.8],
     "extensions": {{"KHR_lights_punctual": {{"light": 0}}}}}},
    {{"camera": 0, "translation": [0.5, 0.1, 0.5], "rotation": [0.70710678, 0, 0, 0.70710678]}}
  ],
  "cameras": [{{"type": "perspective", "perspective": {{"yfov": 1.0471976, "znear": 0.01}}}}],
  "materials": [
    {{"name": "wall", "doubleSided": true,
     "pbrMetallicRoughness": {{"baseColorFactor": [0.5, 0.4, 0.3, 1], "metallicFactor": 0}}}},
    {{"name": "lamp", "doubleSided": true, "emissiveFactor": [1, 1, 1],
     "extensions": {{"KHR_materials_emissive_strength": {{"emissiveStrength": {strength}}}}},
     "pbrMetallicRoughness": {{"baseColorFactor": [0.25, 0.25, 0.25, 1], "metallicFactor": 0}}}}
  ],
  "meshes": [{{"primitives": [
    {{"attributes": {{"POSITION": 0}}, "indices": 1, "material": 0}},
    {{"attributes": {{"POSITION": 0}}, "indices": 2, "material": 1}}
  ]}}],
  "accessors": [
    {{"bufferView": 0, "componentType": 5126, "count": 24, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]}},
    {{"bufferView": 1, "componentType": 5123, "count": 30, "type": "SCALAR"}},
    {{"bufferView": 1, "byteOffset": 60, "componentType": 5123, "count": 6, "type": "SCALAR"}}
  ],
  "bufferViews": [
    {{"buffer": 0, "byteLength": 288}},
    {{"buffer": 0, "byteOffset": 288, "byteLength": 72}}
  ],
  "buffers": [{{{uri}"byteLength": 360}}]
}}
"#
        )
    }

    pub fn glb(&self) -> Vec<u8> {
        glb(&self.gltf(None), &self.buffer())
    }
}

/// A GLB of this JSON and these bytes.
pub fn glb(json: &str, bin: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF".to_vec();
    let word = |n: usize| (n as u32).to_le_bytes();
    bytes.extend(2_u32.to_le_bytes());
    bytes.extend(word(12 + 8 + json.len() + 8 + bin.len()));
    bytes.extend(word(json.len()));
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend(word(bin.len()));
    bytes.extend(b"BIN\0");
    bytes.extend(bin);
    bytes
}

/// A file that must be refused.
pub struct Hostile {
    pub name: &'static str,
    pub file: &'static str,
    pub bytes: Vec<u8>,
    /// What the message must contain.
    pub words: &'static [&'static str],
}

/// One fault each.
pub fn hostile() -> Vec<Hostile> {
    let mut all = Vec::new();
    let base = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let mut obj = |name, text: String, words| {
        all.push(Hostile { name, file: "m.obj", bytes: text.into_bytes(), words });
    };
    obj("empty", String::new(), &["no faces"]);
    obj("points only", "v 0 0 0\n".to_owned(), &["no faces"]);
    obj("no number", "v 0 zero 0\n".to_owned(), &["m.obj:1:1: ", "\"zero\" in `v`"]);
    obj("not a number", format!("{base}v nan 0 0\n"), &["m.obj:5:1: ", "\"nan\"", "finite"]);
    obj("infinite", format!("{base}v 0 inf 0\n"), &["m.obj:5:1: ", "\"inf\"", "finite"]);
    obj("overflow", format!("{base}v 0 1e400 0\n"), &["m.obj:5:1: ", "1e400"]);
    obj("huge", format!("{base}v 0 1e31 0\n"), &["m.obj:5:1: ", "1e31"]);
    obj("far away", "v 0 0 0\nv 1e7 0 0\nv 0 1 0\nf 1 2 3\n".to_owned(), &["coordinates within +-1e6 m"]);
    obj("two coordinates", "v 0 0\n".to_owned(), &["m.obj:1:1: ", "2 numbers of `v`"]);
    obj("five coordinates", "v 0 0 0 0 0\n".to_owned(), &["5 numbers of `v`"]);
    obj("weight of 0", "v 1 1 1 0\n".to_owned(), &["weight w of 0"]);
    obj("index 0", format!("{base}f 0 1 2\n"), &["m.obj:5:1: ", "point 0 of 3"]);
    obj("index past the end", format!("{base}f 1 2 4\n"), &["m.obj:5:1: ", "point 4 of 3"]);
    obj("index before the start", format!("{base}f 1 2 -4\n"), &["m.obj:5:1: ", "point -4 of 3"]);
    obj("largest index", format!("{base}f 1 2 9223372036854775807\n"), &["of 3"]);
    obj("larger index", format!("{base}f 1 2 9223372036854775808\n"), &["expected v, v/vt"]);
    obj(
        "normal past the end",
        format!("{base}vn 0 0 1\nf 1//1 2//1 3//2\n"),
        &["m.obj:6:1: ", "normal 2 of 1"],
    );
    obj("texture past the end", format!("{base}f 1/1 2/1 3/1\n"), &["texture point 1 of 0"]);
    obj("four parts", format!("{base}f 1///1 2 3\n"), &["expected v, v/vt"]);
    obj("two corners", format!("{base}f 1 2\n"), &["a face of 2 corners"]);
    obj("no corners", format!("{base}f\n"), &["a face of 0 corners"]);
    obj("fraction", format!("{base}f 1.5 2 3\n"), &["corner \"1.5\""]);
    obj("library above", format!("mtllib ../m.mtl\n{base}"), &["outside the scene's folder"]);
    obj(
        "library by an absolute path",
        format!("mtllib /etc/passwd\n{base}"),
        &["outside the scene's folder"],
    );
    obj("library of another system", format!("mtllib ..\\m.mtl\n{base}"), &["outside the scene's folder"]);
    obj("material without a name", format!("usemtl\n{base}"), &["m.obj:1:1: ", "`usemtl` without a name"]);
    obj("smooth group", format!("s smooth\n{base}"), &["m.obj:1:1: ", "smooth group"]);
    obj("only degenerate", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n".to_owned(), &["no face with an area"]);
    obj("bytes", "\u{1}\u{2}\u{0}\n".to_owned(), &["m.obj:1:1: ", "expected a statement"]);

    let mut mtl = |name, text: &str, words| {
        all.push(Hostile { name, file: "m.mtl", bytes: text.as_bytes().to_vec(), words });
    };
    mtl("color of two", "newmtl a\nKd 0.5 0.5\n", &["m.mtl:2:1: ", "2 numbers of `Kd`"]);
    mtl("negative color", "newmtl a\nKd 0.5 -0.5 0\n", &["m.mtl:2:1: ", "-0.5 in `Kd`"]);
    mtl("color that is none", "newmtl a\nKe nan 0 0\n", &["m.mtl:2:1: ", "\"nan\""]);
    mtl("spectrum", "newmtl a\nKd spectral a.rfl\n", &["spectrum"]);
    mtl("no name", "newmtl\n", &["`newmtl` without a name"]);
    mtl("opacity", "newmtl a\nd 2\n", &["m.mtl:2:1: ", "`d` \"2\""]);
    mtl("model of light", "newmtl a\nillum 99\n", &["`illum` \"99\""]);
    mtl("picture above", "newmtl a\nmap_Kd ../a.png\n", &["outside the scene's folder"]);
    mtl("rough mirror", "newmtl a\nKd 1 1 1\nPm 1\nPr 0.3\n", &["material 'a'", "rough specular"]);

    let room = Room { bulb: true, ..Room::default() };
    let json = room.gltf(None);
    let mut edit = |name, from: &str, to: &str, words| {
        assert!(json.contains(from), "{name}: {from}");
        let bytes = glb(&json.replacen(from, to, 1), &room.buffer());
        all.push(Hostile { name, file: "m.glb", bytes, words });
    };
    edit("version 1", "\"2.0\"", "\"1.0\"", &["version \"1.0\""]);
    edit("json", "\"asset\"", "asset", &["JSON, line 2"]);
    edit(
        "draco",
        "\"scene\": 0",
        "\"extensionsRequired\": [\"KHR_draco_mesh_compression\"], \"scene\": 0",
        &["KHR_draco_mesh_compression", "compressed geometry"],
    );
    edit(
        "meshopt",
        "\"scene\": 0",
        "\"extensionsRequired\": [\"EXT_meshopt_compression\"], \"scene\": 0",
        &["EXT_meshopt_compression", "compressed geometry"],
    );
    edit("extension", "\"scene\": 0", "\"extensionsRequired\": [\"ACME_new\"], \"scene\": 0", &["ACME_new"]);
    edit(
        "sparse",
        "\"count\": 24,",
        "\"count\": 24, \"sparse\": {\"count\": 1, \"indices\": {\"bufferView\": 0, \"componentType\": 5123}, \"values\": {\"bufferView\": 0}},",
        &["sparse"],
    );
    edit(
        "cycle",
        "\"mesh\": 0, \"name\"",
        "\"children\": [0], \"mesh\": 0, \"name\"",
        &["node 0 is met twice"],
    );
    edit("two parents", "\"nodes\": [0, 1, 2]", "\"nodes\": [0, 1, 0]", &["node 0 is met twice"]);
    edit("node past the end", "\"nodes\": [0, 1, 2]", "\"nodes\": [0, 1, 9]", &["nodes", "past the end"]);
    edit("mesh past the end", "\"mesh\": 0", "\"mesh\": 5", &["mesh", "past the end"]);
    edit("light past the end", "{\"light\": 0}", "{\"light\": 3}", &["light", "past the end"]);
    edit("accessor past the end", "\"indices\": 1", "\"indices\": 77", &["indices", "past the end"]);
    edit(
        "positions past the end",
        "\"POSITION\": 0",
        "\"POSITION\": 65535",
        &["POSITION is accessor 65535 of 3"],
    );
    edit(
        "view past the end",
        "\"bufferView\": 0, \"componentType\": 5126",
        "\"bufferView\": 8, \"componentType\": 5126",
        &["past the end"],
    );
    edit(
        "view past its buffer",
        "\"byteLength\": 288",
        "\"byteLength\": 361",
        &["buffer view 0 ends at byte 361"],
    );
    edit(
        "view far past its buffer",
        "\"byteOffset\": 288",
        "\"byteOffset\": 18446744073709551615",
        &["buffer view 1"],
    );
    edit("values past their view", "\"count\": 24", "\"count\": 25", &["25 values end at byte 300"]);
    edit(
        "four billion values",
        "\"count\": 24",
        "\"count\": 4294967295",
        &["4294967295 values, expected at most"],
    );
    edit("offset past the view", "\"byteOffset\": 60", "\"byteOffset\": 66", &["values end at byte 78"]);
    edit("positions of two", "\"VEC3\"", "\"VEC2\"", &["expected Vec3"]);
    edit(
        "indices of fractions",
        "\"componentType\": 5123, \"count\": 30",
        "\"componentType\": 5126, \"count\": 18",
        &["unsigned"],
    );
    edit("component of no type", "5126", "5199", &["componentType"]);
    edit(
        "buffer longer than it is",
        "\"byteLength\": 360",
        "\"byteLength\": 3600",
        &["byteLength 3600, but 360"],
    );
    edit(
        "buffer elsewhere",
        "\"byteLength\": 360",
        "\"uri\": \"../m.bin\", \"byteLength\": 360",
        &["outside the scene's folder"],
    );
    edit(
        "buffer on the net",
        "\"byteLength\": 360",
        "\"uri\": \"http://x.org/m.bin\", \"byteLength\": 360",
        &["outside the scene's folder"],
    );
    edit(
        "buffer that is missing",
        "\"byteLength\": 360",
        "\"uri\": \"m.bin\", \"byteLength\": 360",
        &["m.bin", "no such file"],
    );
    edit(
        "buffer of damaged base64",
        "\"byteLength\": 360",
        "\"uri\": \"data:;base64,A*\", \"byteLength\": 360",
        &["damaged base64"],
    );
    edit("escape", "\"byteLength\": 360", "\"uri\": \"%zz\", \"byteLength\": 360", &["hexadecimal"]);
    edit(
        "transform",
        "\"translation\": [0.5, 0.5, 0.5]",
        "\"translation\": [1e39, 0.5, 0.5]",
        &["not finite"],
    );
    edit(
        "far away",
        "\"mesh\": 0, \"name\"",
        "\"scale\": [1e30, 1, 1], \"mesh\": 0, \"name\"",
        &["coordinates within"],
    );
    edit("light", "\"intensity\": 1790", "\"intensity\": -1790", &["light", "expected an amount of light"]);
    edit("view angle", "1.0471976", "4.0", &["yfov 4"]);
    edit("emission", "\"emissiveStrength\": 2", "\"emissiveStrength\": -2", &["emissiveStrength"]);
    edit(
        "rough mirror",
        "\"metallicFactor\": 0}",
        "\"metallicFactor\": 1, \"roughnessFactor\": 0.3}",
        &["material 'wall'", "rough specular"],
    );
    edit("base color", "[0.5, 0.4, 0.3, 1]", "[0.5, 0.4, 3.5, 1]", &["material 'wall'", "baseColorFactor"]);

    let whole = room.glb();
    let mut bytes = |name, file, bytes: Vec<u8>, words| all.push(Hostile { name, file, bytes, words });
    bytes("truncated", "m.glb", whole[..whole.len() - 5].to_vec(), &["by its header"]);
    bytes("header only", "m.glb", whole[..12].to_vec(), &["by its header"]);
    bytes("magic", "m.glb", b"BLEND 280".to_vec(), &["\"BLEN\"", "expected \"glTF\""]);
    let mut other = whole.clone();
    other[4] = 1;
    bytes("version of the container", "m.glb", other, &["not a GLB of version 2"]);
    let mut nan = room.buffer();
    nan[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    bytes(
        "position that is no number",
        "m.glb",
        glb(&json, &nan),
        &["position 0 is", "primitive 0 of node 'room'"],
    );
    let mut past = room.buffer();
    past[288..290].copy_from_slice(&24_u16.to_le_bytes());
    bytes("index past the positions", "m.glb", glb(&json, &past), &["index 24 of 24 positions"]);
    bytes("json of a gltf", "m.gltf", b"{\n  \"asset\": }\n".to_vec(), &["m.gltf:2:", "JSON"]);
    bytes("no faces", "m.gltf", b"{\"asset\": {\"version\": \"2.0\"}}".to_vec(), &["no faces"]);
    all
}
