//! Newtypes for dense ids.

/// Implements conversions between ids and indices.
macro_rules! dense_ids {
    ($($id:ident),+) => {$(
        impl $id {
            pub fn index(self) -> usize {
                self.0 as usize
            }

            /// Returns the id of an index.
            pub fn of(index: usize) -> Self {
                Self($crate::number::dense(index))
            }

            /// Returns the ids below `count`.
            pub fn all(count: usize) -> impl Iterator<Item = Self> + Clone {
                (0..$crate::number::dense(count)).map(Self)
            }
        }
    )+};
}

pub(super) use dense_ids;
