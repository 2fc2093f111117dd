//! Enumerations of the model, each with the deck's own words for its values.

/// An enumeration that the deck spells in words.
pub trait Choice: Copy + PartialEq + 'static {
    /// Every word with its value, in the order of the documentation.
    const SPELLINGS: &'static [(&'static str, Self)];
}

/// Declares enumerations: each value with its word, in the order of the documentation.
macro_rules! choices {
    ($(
        $( #[$about:meta] )*
        $type:ident { $( $( #[$of_value:meta] )* $variant:ident = $word:literal, )* }
    )*) => { $(
        $( #[$about] )*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum $type {
            $( $( #[$of_value] )* $variant, )*
        }

        impl $crate::deck::choices::Choice for $type {
            const SPELLINGS: &'static [(&'static str, Self)] = &[ $( ($word, $type::$variant) ),* ];
        }

        impl $type {
            /// All words of the deck for this choice.
            pub const NAMES: &'static [&'static str] = &[ $( $word ),* ];

            /// The deck's word.
            pub fn name(self) -> &'static str {
                match self { $( $type::$variant => $word ),* }
            }
        }
    )* };
}
pub(crate) use choices;
