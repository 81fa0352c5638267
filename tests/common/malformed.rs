//! Malformed scene files, shared by the tests of the library and of the binary.
//!
//! Most are one edit of a valid scene; `«` in the edit marks the expected place and is taken out of the file.

#![allow(dead_code, reason = "each test that includes it uses a part")]

use std::path::{Path, PathBuf};

/// One malformed scene file.
pub struct Malformed {
    /// What is wrong.
    pub name: &'static str,
    /// The file.
    pub content: Content,
    /// Expected line and column, from 1; `None` when there is no text to point into.
    pub place: Option<(usize, usize)>,
    /// What the message must contain: the value, what was expected.
    pub words: &'static [&'static str],
}

/// What stands where the scene file should.
pub enum Content {
    /// Text.
    Text(String),
    /// Bytes that are no text.
    Bytes(Vec<u8>),
    /// A file of this size, all zero bytes.
    Zeros(u64),
    /// Nothing.
    Missing,
    /// A directory.
    Directory,
}

/// The scene that the edits start from.
pub const VALID: &str = r#"version = 1

[camera]
eye = [0.5, -2.0, 0.5]
target = [0.5, 0.5, 0.5]
up = [0.0, 0.0, 1.0]
fov_y_deg = 45.0

[materials.wall]
reflectance = 0.5

[materials.lamp]
reflectance = 0.0
emission = [1.0, 1.0, 1.0]

[[surface]]
name = "floor"
material = "wall"
quad = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]

[[surface]]
name = "ceiling"
material = "lamp"
quad = [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]

[[light]]
kind = "point"
position = [0.5, 0.5, 0.5]
intensity = 1.0

[meshing]
elements = 100
"#;

impl Malformed {
    /// Puts it into `folder` and tells its path.
    pub fn write(&self, folder: &Path) -> PathBuf {
        let path = folder.join("scene.toml");
        match &self.content {
            Content::Text(text) => std::fs::write(&path, text).unwrap(),
            Content::Bytes(bytes) => std::fs::write(&path, bytes).unwrap(),
            Content::Zeros(n) => std::fs::File::create(&path).unwrap().set_len(*n).unwrap(),
            Content::Directory => std::fs::create_dir(&path).unwrap(),
            Content::Missing => {}
        }
        path
    }
}

/// `text` without its mark, and line and column of the mark.
fn marked(text: &str) -> (String, (usize, usize)) {
    let at = text.find('«').expect("a mark in the edit");
    let before = &text[..at];
    let line = before.lines().count().max(1) + usize::from(before.ends_with('\n'));
    let column = before.rsplit('\n').next().unwrap().chars().count() + 1;
    (text.replacen('«', "", 1), (line, column))
}

fn text(name: &'static str, marked_text: &str, words: &'static [&'static str]) -> Malformed {
    let (text, place) = marked(marked_text);
    Malformed { name, content: Content::Text(text), place: Some(place), words }
}

/// The valid scene with `from` (which must stand in it) replaced by `to`.
fn edit(name: &'static str, from: &str, to: &str, words: &'static [&'static str]) -> Malformed {
    assert!(VALID.contains(from), "{name}: {from}");
    text(name, &VALID.replacen(from, to, 1), words)
}

/// The valid scene with its first quad replaced by another shape (a whole line).
fn shape(name: &'static str, line: &str, words: &'static [&'static str]) -> Malformed {
    edit(name, "quad = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]", line, words)
}

/// The valid scene with another emission of the lamp.
fn emission(name: &'static str, lines: &str, words: &'static [&'static str]) -> Malformed {
    edit(name, "emission = [1.0, 1.0, 1.0]", lines, words)
}

/// The valid scene with another light.
fn light(name: &'static str, lines: &str, words: &'static [&'static str]) -> Malformed {
    edit(name, "kind = \"point\"\nposition = [0.5, 0.5, 0.5]\nintensity = 1.0", lines, words)
}

/// The valid scene with a mesh after it.
fn mesh(name: &'static str, lines: &str, words: &'static [&'static str]) -> Malformed {
    text(name, &format!("{VALID}\n{lines}"), words)
}

/// The valid scene with a wall that has edges in common with floor and ceiling, and a continuity.
fn continuity(name: &'static str, lines: &str, words: &'static [&'static str]) -> Malformed {
    let wall = "[[surface]]\nname = \"west\"\nmaterial = \"wall\"\n\
                quad = [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]]\n";
    text(name, &format!("{VALID}\n{wall}[[continuity]]\n{lines}"), words)
}

/// All of them.
pub fn cases() -> Vec<Malformed> {
    [
        files(),
        keys_and_types(),
        numbers(),
        shapes(),
        names(),
        materials(),
        cameras_and_lights(),
        meshing(),
        continuities(),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn continuities() -> Vec<Malformed> {
    vec![
        continuity(
            "continuity with an unknown surface",
            "between = [\"floor\", «\"wets\"]\nis = \"C0\"",
            &["unknown surface \"wets\"", "did you mean \"west\"?"],
        ),
        continuity(
            "continuity of a surface with itself",
            "between = «[\"floor\", \"floor\"]\nis = \"C0\"",
            &["\"floor\" and \"floor\"", "two different surfaces"],
        ),
        continuity(
            "continuity between three surfaces",
            "between = «[\"floor\", \"west\", \"ceiling\"]\nis = \"C0\"",
            &["3 values", "expected 2"],
        ),
        continuity(
            "continuity of a pair twice, the second time the other way round",
            "between = [\"floor\", \"west\"]\nis = \"C0\"\n\
             [[continuity]]\nbetween = «[\"west\", \"floor\"]\nis = \"C1\"",
            &["second continuity", "\"west\" and \"floor\"", "line 39"],
        ),
        continuity(
            "continuity of an unknown kind",
            "between = [\"floor\", \"west\"]\nis = «\"C2\"",
            &["\"C2\"", "\"C1\", \"C0\" or \"C-1\""],
        ),
        continuity(
            "continuity between surfaces without a common edge",
            "between = «[\"floor\", \"ceiling\"]\nis = \"C1\"",
            &["\"floor\" and \"ceiling\" share no edge"],
        ),
        mesh(
            "continuity without its kind",
            "«[[continuity]]\nbetween = [\"floor\", \"ceiling\"]",
            &["missing key `is`"],
        ),
    ]
}

fn files() -> Vec<Malformed> {
    let whole = |name, content, words| Malformed { name, content, place: None, words };
    let garbage: Vec<u8> = (0..=255u8).rev().cycle().take(5000).collect();
    vec![
        whole("missing file", Content::Missing, &["no such file"]),
        whole("directory", Content::Directory, &["directory", "expected a scene file"]),
        whole("file over 64 MiB", Content::Zeros((64 << 20) + 1), &["64 MiB"]),
        Malformed {
            name: "binary garbage",
            content: Content::Bytes(garbage),
            place: Some((1, 1)),
            words: &["0xff", "UTF-8"],
        },
        Malformed {
            name: "not UTF-8 in line 2",
            content: Content::Bytes(b"version = 1\nname = \"caf\xe9\"\n".to_vec()),
            place: Some((2, 12)),
            words: &["0xe9", "UTF-8"],
        },
        Malformed {
            name: "zero bytes",
            content: Content::Zeros(16),
            place: Some((1, 1)),
            words: &["zero byte"],
        },
        text("empty file", "«", &["empty", "version = 1"]),
        text("only white space", "« \n\t\n", &["empty"]),
        text("only a comment", "«# nothing here\n", &["missing key `version`"]),
        text("truncated in an array", "version = 1\n[camera]\neye = [0.5, -2«", &["array", "expected"]),
        text("truncated in a string", "version = 1\n[[surface]]\nname = \"flo«", &["string"]),
        text("truncated in a header", "version = 1\n[[surfa«", &["]"]),
        text("truncated after an equals sign", "version =«", &["value"]),
        text(
            "brackets without end",
            &format!("version = 1\nx = {}«{}", "[".repeat(80), "[".repeat(3000)),
            &["recursion"],
        ),
        text("another format", "«{ \"version\": 1 }\n", &["expected"]),
    ]
}

fn keys_and_types() -> Vec<Malformed> {
    let v = "version = 1";
    vec![
        edit("version missing", v, "«", &["missing key `version`", "version = 1"]),
        edit("version 2", v, "version = «2", &["version 2", "expected 1"]),
        edit("version as a string", v, "version = «\"1\"", &["version \"1\"", "expected 1"]),
        edit("unknown key at the top", v, "version = 1\n«exposure = 2", &["unknown key \"exposure\""]),
        edit(
            "unknown key of a material",
            "reflectance = 0.5",
            "«reflectence = 0.5",
            &["unknown key \"reflectence\"", "did you mean \"reflectance\"?"],
        ),
        edit(
            "unknown key of a surface",
            "quad = [[0, 0, 0]",
            "«qaud = [[0, 0, 0]",
            &["unknown key \"qaud\"", "did you mean \"quad\"?"],
        ),
        shape(
            "unknown key of a sphere",
            "sphere = { center = [0, 0, 0], «radios = 1 }",
            &["unknown key \"radios\"", "did you mean \"radius\"?"],
        ),
        edit("unknown table", "[meshing]", "[«meshes]", &["unknown key \"meshes\""]),
        edit("key twice", "up = [0.0, 0.0, 1.0]", "up = [0.0, 0.0, 1.0]\n«up = [0, 1, 0]", &["duplicate"]),
        edit("table twice", "[meshing]", "[meshing]\n[«meshing]", &["duplicate"]),
        edit(
            "camera without an eye",
            "[camera]\neye = [0.5, -2.0, 0.5]",
            "«[camera]",
            &["missing key `eye`"],
        ),
        edit(
            "surface without a name",
            "[[surface]]\nname = \"floor\"",
            "«[[surface]]",
            &["missing key `name`"],
        ),
        edit(
            "string for a number",
            "fov_y_deg = 45.0",
            "fov_y_deg = «\"45\"",
            &["\"45\"", "expected an angle"],
        ),
        edit(
            "boolean for a reflectance",
            "reflectance = 0.5",
            "reflectance = «true",
            &["`true`", "expected a share"],
        ),
        edit("number for a name", "name = \"floor\"", "name = «1", &["`1`", "expected a string"]),
        edit(
            "string for a flag",
            "material = \"wall\"",
            "material = \"wall\"\ntwo_sided = «\"yes\"",
            &["\"yes\"", "expected a boolean"],
        ),
        edit(
            "fraction for a group",
            "material = \"wall\"",
            "material = \"wall\"\nsmooth_group = «1.5",
            &["1.5", "whole number"],
        ),
        edit(
            "negative group",
            "material = \"wall\"",
            "material = \"wall\"\nsmooth_group = «-1",
            &["-1", "whole number"],
        ),
        edit("number for a point", "eye = [0.5, -2.0, 0.5]", "eye = «0.5", &["0.5", "an array of 3"]),
        edit(
            "point of two numbers",
            "eye = [0.5, -2.0, 0.5]",
            "eye = «[0.5, -2.0]",
            &["2 values", "expected 3"],
        ),
        edit(
            "point of four numbers",
            "eye = [0.5, -2.0, 0.5]",
            "eye = «[0.5, -2.0, 0.5, 1.0]",
            &["4 values", "expected 3"],
        ),
        edit(
            "string in a point",
            "eye = [0.5, -2.0, 0.5]",
            "eye = [0.5, «\"a\", 0.5]",
            &["\"a\"", "expected a finite number"],
        ),
        edit("date for a number", "fov_y_deg = 45.0", "fov_y_deg = «1992-09-07", &["expected an angle"]),
        text(
            "table for the surfaces",
            "version = 1\n«[surface]\nname = \"floor\"\n",
            &["table", "array of tables"],
        ),
        text("number for the surfaces", "version = 1\nsurface = «3\n", &["`3`", "array of tables"]),
        text(
            "array for the camera",
            "version = 1\ncamera = «[[0, 0, 0], [1, 0, 0], [0, 0, 1], 45]\n",
            &["table"],
        ),
    ]
}

fn numbers() -> Vec<Malformed> {
    let eye = "eye = [0.5, -2.0, 0.5]";
    vec![
        edit("NaN", eye, "eye = [0.5, «nan, 0.5]", &["camera.eye: NaN", "finite number"]),
        edit("infinity", eye, "eye = [0.5, -2.0, «-inf]", &["-inf", "finite number"]),
        edit("float overflow", eye, "eye = [«1e999, -2.0, 0.5]", &["overflow"]),
        edit("coordinate beyond the limit", eye, "eye = [0.5, -2.0, «1000001]", &["1000001", "1e6"]),
        edit("integer beyond 64 bits", eye, "eye = [«99999999999999999999, 0, 0]", &["finite number"]),
        edit("NaN reflectance", "reflectance = 0.5", "reflectance = «nan", &["NaN", "[0, 1)"]),
        edit(
            "NaN in a corner",
            "[[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]",
            "[[0, 0, 0], [1, 0, 0], [1, «nan, 0], [0, 1, 0]]",
            &["NaN", "finite number"],
        ),
    ]
}

fn shapes() -> Vec<Malformed> {
    vec![
        edit(
            "no shape",
            "[[surface]]\nname = \"floor\"\nmaterial = \"wall\"\nquad = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]",
            "«[[surface]]\nname = \"floor\"\nmaterial = \"wall\"",
            &["no shape", "\"floor\"", "quad, triangle"],
        ),
        shape(
            "two shapes",
            "quad = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\nsphere = «{ center = [0, 0, 0], radius = 1 }",
            &["a quad and a sphere", "one shape"],
        ),
        shape(
            "non-planar quad",
            "quad = «[[5.528, 0, 0], [5.496, 0, 5.592], [5.56, 5.488, 5.592], [5.56, 5.488, 0]]",
            &["not planar", "0.57", "1e-6", "two triangles"],
        ),
        shape(
            "quad that is non-planar by 2e-6",
            "quad = «[[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.000002]]",
            &["not planar", "2.000e-6"],
        ),
        shape(
            "concave quad",
            "quad = «[[0, 0, 0], [1, 0, 0], [0.25, 0.25, 0], [0, 1, 0]]",
            &["concave", "corner 3", "two triangles"],
        ),
        shape("crossed quad", "quad = «[[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0]]", &["cross each other"]),
        shape(
            "quad with three corners on a line",
            "quad = «[[0, 0, 0], [0.5, 0, 0], [1, 0, 0], [0, 1, 0]]",
            &["corner 2", "triangle"],
        ),
        shape(
            "quad on a line",
            "quad = «[[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]",
            &["one line", "zero area"],
        ),
        shape(
            "quad with a corner twice",
            "quad = «[[0, 0, 0], [1, 0, 0], [1, 0, 0], [0, 1, 0]]",
            &["corners 2 and 3", "zero area"],
        ),
        shape("quad that is a point", "quad = «[[1, 1, 1], [1, 1, 1], [1, 1, 1], [1, 1, 1]]", &["zero area"]),
        shape(
            "quad of three corners",
            "quad = «[[0, 0, 0], [1, 0, 0], [1, 1, 0]]",
            &["3 values", "expected 4"],
        ),
        shape("triangle on a line", "triangle = «[[0, 0, 0], [1, 1, 1], [2, 2, 2]]", &["zero area"]),
        shape(
            "triangle too small to have an area",
            "triangle = «[[0, 0, 0], [1e-300, 0, 0], [0, 1e-300, 0]]",
            &["zero area"],
        ),
        shape(
            "disk without a normal",
            "disk = { center = [0, 0, 0], normal = «[0, 0, 0], radius = 1 }",
            &["normal", "no direction"],
        ),
        shape(
            "disk of radius 0",
            "disk = { center = [0, 0, 0], normal = [0, 0, 1], radius = «0 }",
            &["0, expected a length over 0"],
        ),
        shape(
            "sphere of negative radius",
            "sphere = { center = [0, 0, 0], radius = «-0.5 }",
            &["-0.5", "length over 0"],
        ),
        shape("sphere without a radius", "sphere = «{ center = [0, 0, 0] }", &["missing key `radius`"]),
        shape(
            "cylinder without a length",
            "cylinder = { base = [1, 2, 3], top = «[1, 2, 3], radius = 1 }",
            &["base", "zero area"],
        ),
        shape("array for a sphere", "sphere = «[[0, 0, 0], 1]", &["array", "table of keys"]),
    ]
}

fn names() -> Vec<Malformed> {
    vec![
        edit(
            "name twice",
            "name = \"ceiling\"",
            "name = «\"floor\"",
            &["second surface", "\"floor\"", "unique", "line 17"],
        ),
        edit("empty name", "name = \"ceiling\"", "name = «\"\"", &["empty name"]),
        edit(
            "unknown material",
            "material = \"wall\"",
            "material = «\"wal\"",
            &["unknown material \"wal\"", "did you mean \"wall\"?"],
        ),
        text("no surfaces", "«version = 1\n[materials.white]\nreflectance = 0.5\n", &["without surfaces"]),
        mesh("mesh file by an absolute path", "[[mesh]]\nfile = «\"/etc/table.obj\"\n", &["outside"]),
        mesh("mesh file above the folder", "[[mesh]]\nfile = «\"../table.obj\"\n", &["outside"]),
        mesh("mesh file above the folder, hidden", "[[mesh]]\nfile = «\"a/../../table.obj\"\n", &["outside"]),
        mesh("missing mesh file", "[[mesh]]\nfile = «\"table.obj\"\n", &["no such mesh file", "table.obj"]),
        mesh("mesh file of unknown kind", "[[mesh]]\nfile = «\"scene.toml\"\n", &[".obj"]),
        mesh("mesh with an unknown unit", "[[mesh]]\nfile = \"t.obj\"\nunit = «\"km\"\n", &["km", "mm"]),
    ]
}

fn materials() -> Vec<Malformed> {
    let rho = "reflectance = 0.5";
    vec![
        edit(
            "reflectance 1.2",
            rho,
            "reflectance = «1.2",
            &["materials.wall.reflectance: 1.2, expected", "[0, 1)"],
        ),
        edit("reflectance 1", rho, "reflectance = «1", &["1, expected", "[0, 1)"]),
        edit("negative reflectance", rho, "reflectance = [0.5, «-0.1, 0.5]", &["-0.1", "[0, 1)"]),
        edit("reflectance of two channels", rho, "reflectance = «[0.5, 0.5]", &["2 values", "expected 3"]),
        edit(
            "shares that sum to 1.1 in green",
            rho,
            "reflectance = [0.1, 0.6, 0.1]\nspecular = «0.5",
            &["1.1", "green", "under 1"],
        ),
        edit(
            "shares that sum to 1",
            rho,
            "reflectance = 0.25\nspecular = 0.25\ntransmission = «0.5",
            &["is 1 in red", "under 1"],
        ),
        edit("index of refraction under 1", rho, "transmission = 0.9\nior = «0.9", &["0.9", "from 1 to 10"]),
        emission("negative emission", "emission = [1.0, «-1.0, 1.0]", &["-1", "from 0"]),
        emission("emission beyond the limit", "emission = «1e13", &["10000000000000", "1e12"]),
        emission("two units of emission", "emission = 1\nlumens = «800", &["lumens beside emission"]),
        emission(
            "two photometric units",
            "luminance_cd_m2 = 9\nlumens = «8",
            &["lumens beside luminance_cd_m2"],
        ),
        emission("negative lumens", "lumens = «-800", &["-800", "from 0"]),
        emission("color of a radiometric emission", "emission = 1\ncolor = «[1, 1, 1]", &["color", "lumens"]),
        emission("color without an emission", "color = «[1, 1, 1]", &["color", "lumens"]),
        emission("black color", "power_w = 10\ncolor = «0", &["black color"]),
        emission("three luminances", "luminance_cd_m2 = «[1, 1, 1]", &["expected an amount"]),
        edit(
            "power of a surface too small for it",
            "material = \"lamp\"\nquad = [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]",
            "material = «\"bulb\"\nsphere = { center = [0, 0, 1], radius = 1e-9 }\n[materials.bulb]\nlumens = 1e6",
            &["would emit", "1e12"],
        ),
    ]
}

fn cameras_and_lights() -> Vec<Malformed> {
    let target = "target = [0.5, 0.5, 0.5]";
    vec![
        edit("eye is target", target, "target = «[0.5, -2.0, 0.5]", &["target", "eye"]),
        edit("up along the view", "up = [0.0, 0.0, 1.0]", "up = «[0.0, -3.0, 0.0]", &["parallel"]),
        edit("up without a direction", "up = [0.0, 0.0, 1.0]", "up = «[0, 0, 0]", &["no direction"]),
        edit("field of view 0", "fov_y_deg = 45.0", "fov_y_deg = «0", &["0, expected", "180"]),
        edit("field of view 180", "fov_y_deg = 45.0", "fov_y_deg = «180.0", &["180, expected"]),
        light(
            "unknown kind of light",
            "kind = «\"piont\"\nposition = [0, 0, 0]\nintensity = 1",
            &["\"piont\"", "did you mean \"point\"?"],
        ),
        edit(
            "point light without a position",
            "[[light]]\nkind = \"point\"\nposition = [0.5, 0.5, 0.5]",
            "«[[light]]\nkind = \"point\"",
            &["missing key `position`"],
        ),
        edit(
            "light without intensity",
            "[[light]]\nkind = \"point\"\nposition = [0.5, 0.5, 0.5]\nintensity = 1.0",
            "«[[light]]\nkind = \"point\"\nposition = [0, 0, 1]",
            &["intensity"],
        ),
        light(
            "two intensities",
            "kind = \"point\"\nposition = [0, 0, 1]\nintensity = 1\nintensity_cd = «100",
            &["intensity_cd beside intensity"],
        ),
        light(
            "point light with a direction",
            "kind = \"point\"\nposition = [0, 0, 1]\nintensity = 1\ndirection = «[0, 0, 1]",
            &["`direction` of a point light"],
        ),
        light(
            "spot that ends inside its core",
            "kind = \"spot\"\nposition = [0, 0, 1]\ndirection = [0, 0, -1]\nintensity = 1\n\
             inner_deg = 30\nouter_deg = «20",
            &["outer_deg 20", "inner_deg 30"],
        ),
        light(
            "spot wider than a half space",
            "kind = \"spot\"\nposition = [0, 0, 1]\ndirection = [0, 0, -1]\nintensity = 1\nouter_deg = «91",
            &["91", "0 to 90"],
        ),
        light(
            "directional light without a direction",
            "kind = \"directional\"\ndirection = «[0, 0, 0]\nirradiance = 1",
            &["no direction"],
        ),
        light(
            "directional light with an intensity",
            "kind = \"directional\"\ndirection = [0, 0, -1]\nintensity = «1",
            &["`intensity` of a directional light"],
        ),
        light(
            "negative intensity",
            "kind = \"point\"\nposition = [0, 0, 1]\nintensity = «-1",
            &["-1", "from 0"],
        ),
    ]
}

fn meshing() -> Vec<Malformed> {
    let n = "elements = 100";
    vec![
        edit("1e9 elements", n, "elements = «1000000000", &["1000000000", "4000000"]),
        edit("1e9 elements as a float", n, "elements = «1e9", &["1000000000", "4000000"]),
        edit("elements beyond 64 bits", n, "elements = «99999999999999999999999", &["4000000"]),
        edit("no elements", n, "elements = «0", &["0, expected", "from 1"]),
        edit("negative elements", n, "elements = «-4", &["-4", "from 1"]),
        edit("two targets", n, "elements = 100\nmax_element_m = «0.1", &["max_element_m beside elements"]),
        edit("element of size 0", n, "max_element_m = «0", &["0, expected", "over 0"]),
        edit("too small an element", n, "max_element_m = «0.0001", &["2.000e8 elements", "4000000"]),
        edit("number for adaptive", n, "adaptive = «1", &["`1`", "expected a boolean"]),
    ]
}
