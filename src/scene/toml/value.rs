//! Values of a scene file that are checked as they are read, so that a fault is placed on the very number.
//!
//! ```text
//! TOML integer | float           --> Num<Kind>        finite and within Kind's range
//! TOML integer                   --> Whole<MIN, MAX>
//! number | [number; 3]           --> Color<Kind>
//! [T; N], neither more nor fewer --> Fixed<T, N>
//! table, not array               --> Table<T>
//! ```

use std::fmt;
use std::marker::PhantomData;

use glam::DVec3;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Unexpected, Visitor};

use crate::units::Rgb;

/// Largest coordinate, length and radius (m): beyond it a board step of 2^-24 of the scene is over 0.1 m.
pub(super) const MAX_COORDINATE_M: f64 = 1e6;

/// Largest exitance, power, intensity in whatever unit; the sun's surface has 6e7 W/m^2.
pub(super) const MAX_LIGHT: f64 = 1e12;

/// A range of numbers with a name.
pub(super) trait Kind {
    /// What is expected, for messages: "a share in [0, 1)".
    const EXPECTED: &'static str;
    /// Whether a finite number lies in the range.
    fn admits(value: f64) -> bool;
}

/// Declares kinds: name, expectation, range.
macro_rules! kinds {
    ($($(#[$doc:meta])* $name:ident, $expected:literal, |$x:ident| $admits:expr;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub(super) struct $name;
        impl Kind for $name {
            const EXPECTED: &'static str = $expected;
            fn admits($x: f64) -> bool {
                $admits
            }
        }
    )*};
}

kinds! {
    /// One coordinate of a point (m) or of a direction.
    Coordinate, "a finite number within -1e6 to 1e6", |x| x.abs() <= MAX_COORDINATE_M;
    /// A length (m).
    Length, "a length over 0 and up to 1e6 m", |x| x > 0.0 && x <= MAX_COORDINATE_M;
    /// A reflectance or transmittance.
    Share, "a share of the light in [0, 1)", |x| (0.0..1.0).contains(&x);
    /// Exitance, power, intensity.
    Amount, "an amount of light from 0 to 1e12", |x| (0.0..=MAX_LIGHT).contains(&x);
    /// Index of refraction.
    Refraction, "an index of refraction from 1 to 10", |x| (1.0..=10.0).contains(&x);
    /// Field of view (degrees).
    FieldOfView, "an angle between 0 and 180 degrees, both excluded", |x| x > 0.0 && x < 180.0;
    /// Exponent of the grading toward borders.
    Grading, "a grading from 1 (even) to 4", |x| (1.0..=4.0).contains(&x);
    /// Half angle of a spot's cone (degrees).
    HalfAngle, "a half angle from 0 to 90 degrees", |x| (0.0..=90.0).contains(&x);
}

/// A finite number of one kind.
#[derive(Clone, Copy, Debug)]
pub(super) struct Num<K>(pub(super) f64, PhantomData<K>);

impl<K: Kind> Num<K> {
    fn new<E: Error>(value: f64) -> Result<Self, E> {
        if value.is_finite() && K::admits(value) {
            return Ok(Num(value, PhantomData));
        }
        Err(E::custom(format_args!("{value}, expected {}", K::EXPECTED)))
    }
}

struct NumVisitor<K>(PhantomData<K>);

impl<K: Kind> Visitor<'_> for NumVisitor<K> {
    type Value = Num<K>;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(K::EXPECTED)
    }
    fn visit_f64<E: Error>(self, value: f64) -> Result<Num<K>, E> {
        Num::new(value)
    }
    fn visit_i64<E: Error>(self, value: i64) -> Result<Num<K>, E> {
        Num::new(value as f64)
    }
    fn visit_u64<E: Error>(self, value: u64) -> Result<Num<K>, E> {
        Num::new(value as f64)
    }
}

impl<'de, K: Kind> Deserialize<'de> for Num<K> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(NumVisitor(PhantomData))
    }
}

/// A whole number from MIN to MAX.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Whole<const MIN: u32, const MAX: u32>(pub(crate) u32);

struct WholeVisitor<const MIN: u32, const MAX: u32>;

impl<const MIN: u32, const MAX: u32> Visitor<'_> for WholeVisitor<MIN, MAX> {
    type Value = Whole<MIN, MAX>;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a whole number from {MIN} to {MAX}")
    }
    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        match u32::try_from(value) {
            Ok(v) if (MIN..=MAX).contains(&v) => Ok(Whole(v)),
            _ => Err(E::custom(format_args!("{value}, expected a whole number from {MIN} to {MAX}"))),
        }
    }
    fn visit_u64<E: Error>(self, value: u64) -> Result<Self::Value, E> {
        Err(E::invalid_value(Unexpected::Unsigned(value), &self))
    }
}

impl<'de, const MIN: u32, const MAX: u32> Deserialize<'de> for Whole<MIN, MAX> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(WholeVisitor)
    }
}

/// An array of exactly N values. (serde's own arrays let further values pass unseen.)
#[derive(Clone, Copy, Debug)]
pub(super) struct Fixed<T, const N: usize>(pub(super) [T; N]);

struct FixedVisitor<T, const N: usize>(PhantomData<T>);

impl<'de, T: Deserialize<'de>, const N: usize> Visitor<'de> for FixedVisitor<T, N> {
    type Value = Fixed<T, N>;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "an array of {N} values")
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let mut values = Vec::with_capacity(N);
        while let Some(value) = seq.next_element()? {
            values.push(value);
        }
        let n = values.len();
        values.try_into().map(Fixed).map_err(|_| A::Error::custom(format_args!("{n} values, expected {N}")))
    }
}

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for Fixed<T, N> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(FixedVisitor(PhantomData))
    }
}

/// A table of keys. (serde's own structs are also read from arrays, their fields in order.)
#[derive(Clone, Copy, Debug)]
pub(crate) struct Table<T>(pub(crate) T);

struct TableVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for TableVisitor<T> {
    type Value = Table<T>;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table of keys")
    }
    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
        T::deserialize(MapAccessDeserializer::new(map)).map(Table)
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Table<T> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(TableVisitor(PhantomData))
    }
}

/// A point (m) or a direction.
pub(super) type Vector = Fixed<Num<Coordinate>, 3>;

impl Vector {
    /// As a vector of the host.
    pub(super) fn to_dvec3(self) -> DVec3 {
        DVec3::from_array(self.0.map(|c| c.0))
    }
}

/// Three channels, written as an array or as one number for all.
#[derive(Clone, Copy, Debug)]
pub(super) struct Color<K>(pub(super) Rgb, PhantomData<K>);

struct ColorVisitor<K>(PhantomData<K>);

impl<'de, K: Kind> Visitor<'de> for ColorVisitor<K> {
    type Value = Color<K>;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, or an array of three", K::EXPECTED)
    }
    fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
        Num::<K>::new(value).map(|v| Color(Rgb::splat(v.0), PhantomData))
    }
    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        self.visit_f64(value as f64)
    }
    fn visit_u64<E: Error>(self, value: u64) -> Result<Self::Value, E> {
        self.visit_f64(value as f64)
    }
    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Self::Value, A::Error> {
        let channels: Fixed<Num<K>, 3> = FixedVisitor(PhantomData).visit_seq(seq)?;
        Ok(Color(Rgb(channels.0.map(|c| c.0)), PhantomData))
    }
}

impl<'de, K: Kind> Deserialize<'de> for Color<K> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(ColorVisitor(PhantomData))
    }
}
