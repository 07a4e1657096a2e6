//! Newtypes for dense ids.

/// From ids to indices and back.
macro_rules! dense_ids {
    ($($id:ident),+) => {$(
        impl $id {
            pub fn index(self) -> usize {
                self.0 as usize
            }

            /// The id of what stands at an index.
            pub fn of(index: usize) -> Self {
                Self($crate::number::dense(index))
            }

            /// The first ids, so many.
            pub fn all(count: usize) -> impl Iterator<Item = Self> + Clone {
                (0..$crate::number::dense(count)).map(Self)
            }
        }
    )+};
}

pub(super) use dense_ids;
