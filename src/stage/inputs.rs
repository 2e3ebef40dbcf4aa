//! Typed bundles of input artifacts.

use isospline_artifact::{RowsError, SectionSource, View};

/// Finds an input artifact by its kind.
pub trait InputSource {
    /// The artifact of this kind.
    fn input(&self, kind: &str) -> Option<&dyn SectionSource>;
}

/// A bundle of views: `()`, a view, or a tuple of up to six.
pub trait Inputs<'a>: Sized + Copy + Send + Sync {
    /// The kinds read, in order.
    const KINDS: &'static [&'static str];

    /// Opens all views.
    ///
    /// # Errors
    /// [`RowsError`] of the first artifact that is missing or has another shape.
    fn open(source: &'a dyn InputSource) -> Result<Self, RowsError>;
}

fn view<'a, V: View<'a>>(source: &'a dyn InputSource) -> Result<V, RowsError> {
    let missing = RowsError::Missing { kind: V::KIND, section: "(all)" };
    V::from_source(source.input(V::KIND).ok_or(missing)?)
}

impl<'a> Inputs<'a> for () {
    const KINDS: &'static [&'static str] = &[];

    fn open(_: &'a dyn InputSource) -> Result<Self, RowsError> {
        Ok(())
    }
}

macro_rules! tuple_inputs {
    ($($view:ident),+) => {
        impl<'a, $($view: View<'a>),+> Inputs<'a> for ($($view,)+) {
            const KINDS: &'static [&'static str] = &[$($view::KIND),+];

            fn open(source: &'a dyn InputSource) -> Result<Self, RowsError> {
                Ok(($(view::<$view>(source)?,)+))
            }
        }
    };
}

tuple_inputs!(A);
tuple_inputs!(A, B);
tuple_inputs!(A, B, C);
tuple_inputs!(A, B, C, D);
tuple_inputs!(A, B, C, D, E);
tuple_inputs!(A, B, C, D, E, F);
