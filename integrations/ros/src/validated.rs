//! Deserialisation of tables whose keys depend on each other.

use std::fmt;
use std::marker::PhantomData;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserialize, Deserializer, Error, MapAccess, Visitor};

/// Deserialises a table with independent keys and converts it. Unlike with `#[serde(try_from)]`, an error of
/// the conversion has the position of the table, and not that of the list which contains it.
pub(crate) fn validated<'de, E, T, D>(deserializer: D) -> Result<T, D::Error>
where
    E: Deserialize<'de>,
    T: TryFrom<E>,
    T::Error: fmt::Display,
    D: Deserializer<'de>,
{
    deserializer.deserialize_map(Table::<E, T>(PhantomData))
}

struct Table<E, T>(PhantomData<fn() -> (E, T)>);

impl<'de, E, T> Visitor<'de> for Table<E, T>
where
    E: Deserialize<'de>,
    T: TryFrom<E>,
    T::Error: fmt::Display,
{
    type Value = T;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a table")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
        let entry = E::deserialize(MapAccessDeserializer::new(map))?;
        T::try_from(entry).map_err(A::Error::custom)
    }
}
