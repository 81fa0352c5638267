//! A row of the validation table.

/// What a row is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Group {
    /// Geometry of light between two surfaces.
    ViewFactor,
    /// Areas of curved surfaces.
    Area,
    /// The kernel by itself.
    Kernel,
    /// Constant emission and reflectance in a closed room.
    Furnace,
    /// Power in, power out.
    Energy,
    /// The test scene of the 1992 reconstruction paper.
    LitCube,
    /// CIE 171:2006.
    Cie171,
    /// One way of shooting against the other.
    Methods,
}

impl Group {
    /// All of them, in the order of the table.
    pub const ALL: [Group; 8] = [
        Group::ViewFactor,
        Group::Kernel,
        Group::Area,
        Group::Furnace,
        Group::Energy,
        Group::LitCube,
        Group::Cie171,
        Group::Methods,
    ];

    /// Title of its table.
    pub fn title(self) -> &'static str {
        match self {
            Group::ViewFactor => "View factors",
            Group::Kernel => "Kernel",
            Group::Area => "Areas",
            Group::Furnace => "Furnaces",
            Group::Energy => "Energy",
            Group::LitCube => "Lit cube",
            Group::Cie171 => "CIE 171",
            Group::Methods => "Hemisphere and vertex",
        }
    }
}

/// A case, what a formula says and what we say.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// What it is about.
    pub group: Group,
    /// The case.
    pub case: String,
    /// The formula and its source.
    pub formula: &'static str,
    /// By the formula.
    pub expected: f64,
    /// By the solver.
    pub ours: f64,
    /// Largest allowed |error|.
    pub bound: f64,
}

impl Row {
    /// ours / expected - 1, or ours where 0 is expected.
    pub fn error(&self) -> f64 {
        if self.expected == 0.0 { self.ours } else { self.ours / self.expected - 1.0 }
    }

    /// The error is within its bound; never of a NaN.
    pub fn holds(&self) -> bool {
        self.error().abs() <= self.bound
    }
}
