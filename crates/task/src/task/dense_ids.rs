//! Macro that implements dense ids, i.e. newtypes of `u32` that count from 0.

macro_rules! dense_ids {
    ($($id:ident),+) => {$(
        impl $id {
            pub fn index(self) -> usize {
                self.0 as usize
            }

            /// Creates the id with this index.
            pub fn of(index: usize) -> Self {
                Self($crate::number::dense(index))
            }

            /// Returns all ids with an index below `count`.
            pub fn all(count: usize) -> impl Iterator<Item = Self> + Clone {
                (0..$crate::number::dense(count)).map(Self)
            }
        }
    )+};
}

pub(super) use dense_ids;
