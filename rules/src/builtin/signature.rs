//! Signatures of the built-ins: names, numbers of arguments, and which arguments are computed from the
//! others.

use super::custom::{CustomBuiltIn, Definition};

/// Namespace of SWRL's built-ins.
pub const SWRLB: &str = "http://www.w3.org/2003/11/swrlb#";

macro_rules! built_ins {
    ($($(#[$doc:meta])* $variant:ident $name:literal $minimum:literal..=$maximum:literal $kind:ident,)*) => {
        /// A built-in predicate or function on literals.
        #[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
        #[non_exhaustive]
        pub enum BuiltIn {
            $($(#[$doc])* $variant,)*
            /// A built-in outside SWRL, see [`BuiltIn::custom`].
            Custom(CustomBuiltIn),
        }

        impl BuiltIn {
            /// The built-ins of SWRL except those on lists, and additionally the two data range tests
            /// ([`BuiltIn::DataRange`], [`BuiltIn::OutsideDataRange`]). Custom built-ins are not included.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// Returns the local name of a built-in of SWRL or of a data range test, or the IRI of a custom built-in.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                    Self::Custom(custom) => custom.definition().iri(),
                }
            }

            /// Returns the minimum and maximum number of arguments, and the direction of computation.
            /// `None` for a custom built-in.
            pub(super) fn shape(self) -> Option<(usize, usize, Kind)> {
                match self {
                    $(Self::$variant => Some(($minimum, $maximum, Kind::$kind)),)*
                    Self::Custom(_) => None,
                }
            }
        }
    };
}

/// Direction in which a built-in computes its arguments.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// All arguments must be bound.
    Test,
    /// The first argument is computed from the others.
    Function,
    /// The first argument is a value composed of the other arguments; or the other arguments are the parts
    /// into which the first is split.
    Parts,
    /// The first argument is one of several values, which are computed from the others.
    Choice,
}

built_ins! {
    /// Tests that the first argument lies in the value space of a datatype. The second argument, an
    /// `xsd:anyURI`, is the IRI of the datatype. This is SWRL's data range atom, not a member of `swrlb`.
    /// Rule text: `xsd:decimal(?x)`.
    DataRange "dataRange" 2..=2 Test,
    /// Tests that the first argument is a literal that certainly lies outside the value space of a
    /// datatype. This is the complement of a data range, which exists in OWL but not in SWRL. Rule text:
    /// `not xsd:decimal(?x)`.
    OutsideDataRange "outsideDataRange" 2..=2 Test,
    /// Tests that the two arguments compare equal. Numbers of different types are promoted: `1` equals `1e0`.
    Equal "equal" 2..=2 Test,
    /// Tests that the two arguments do not compare equal; incomparable arguments pass. False for ill-typed
    /// literals.
    NotEqual "notEqual" 2..=2 Test,
    /// Tests that the first argument is less than the second.
    LessThan "lessThan" 2..=2 Test,
    /// Tests that the first argument is less than or equal to the second.
    LessThanOrEqual "lessThanOrEqual" 2..=2 Test,
    /// Tests that the first argument is greater than the second.
    GreaterThan "greaterThan" 2..=2 Test,
    /// Tests that the first argument is greater than or equal to the second.
    GreaterThanOrEqual "greaterThanOrEqual" 2..=2 Test,
    /// Sum of the second and all further arguments.
    Add "add" 3..=32 Function,
    /// Second argument minus the third.
    Subtract "subtract" 3..=3 Function,
    /// Product of the second and all further arguments.
    Multiply "multiply" 3..=32 Function,
    /// Second argument divided by the third.
    Divide "divide" 3..=3 Function,
    /// Second argument divided by the third, truncated to an integer.
    IntegerDivide "integerDivide" 3..=3 Function,
    /// Remainder of the truncating division of the second argument by the third.
    Mod "mod" 3..=3 Function,
    /// Second argument to the power of the third.
    Pow "pow" 3..=3 Function,
    /// Second argument, unchanged.
    UnaryPlus "unaryPlus" 2..=2 Function,
    /// Second argument, negated.
    UnaryMinus "unaryMinus" 2..=2 Function,
    /// Absolute value of the second argument.
    Abs "abs" 2..=2 Function,
    /// Smallest integer that is not below the second argument.
    Ceiling "ceiling" 2..=2 Function,
    /// Largest integer that is not above the second argument.
    Floor "floor" 2..=2 Function,
    /// Integer nearest to the second argument; halves are rounded towards positive infinity.
    Round "round" 2..=2 Function,
    /// Second argument, rounded to the number of fractional digits in the third argument (by default 0);
    /// halves are rounded to even.
    RoundHalfToEven "roundHalfToEven" 2..=3 Function,
    /// Sine of the second argument, in radians.
    Sin "sin" 2..=2 Function,
    /// Cosine of the second argument, in radians.
    Cos "cos" 2..=2 Function,
    /// Tangent of the second argument, in radians.
    Tan "tan" 2..=2 Function,
    /// Boolean negation of the second argument.
    BooleanNot "booleanNot" 2..=2 Function,
    /// Tests that the two arguments are equal strings, ignoring case.
    StringEqualIgnoreCase "stringEqualIgnoreCase" 2..=2 Test,
    /// Concatenation of the second and all further arguments.
    StringConcat "stringConcat" 2..=32 Function,
    /// Substring of the second argument, from the position in the third (counted from 1), with the length in
    /// the optional fourth.
    Substring "substring" 3..=4 Function,
    /// Number of characters of the second argument.
    StringLength "stringLength" 2..=2 Function,
    /// Second argument without white space at the ends, and with each sequence of white space inside replaced by one
    /// space.
    NormalizeSpace "normalizeSpace" 2..=2 Function,
    /// Second argument in upper case.
    UpperCase "upperCase" 2..=2 Function,
    /// Second argument in lower case.
    LowerCase "lowerCase" 2..=2 Function,
    /// Second argument in which each character of the third argument is replaced by the character at the
    /// corresponding position of the fourth argument, or removed if that argument is too short.
    Translate "translate" 4..=4 Function,
    /// Tests that the first argument contains the second.
    Contains "contains" 2..=2 Test,
    /// Tests that the first argument contains the second, ignoring case.
    ContainsIgnoreCase "containsIgnoreCase" 2..=2 Test,
    /// Tests that the first argument starts with the second.
    StartsWith "startsWith" 2..=2 Test,
    /// Tests that the first argument ends with the second.
    EndsWith "endsWith" 2..=2 Test,
    /// Part of the second argument before the first occurrence of the third; empty if the third does not
    /// occur.
    SubstringBefore "substringBefore" 3..=3 Function,
    /// Part of the second argument after the first occurrence of the third; empty if the third does not
    /// occur.
    SubstringAfter "substringAfter" 3..=3 Function,
    /// Tests that the first argument contains a match of the second, a regular expression. The optional third
    /// argument contains `XPath` flags.
    Matches "matches" 2..=3 Test,
    /// Second argument in which each match of the third, a regular expression, is replaced by the fourth. The
    /// optional fifth argument contains flags.
    Replace "replace" 4..=5 Function,
    /// One of the substrings of the second argument between matches of the third, a regular expression. The
    /// optional fourth argument contains flags. In SWRL the result is a sequence, for which the engine has no
    /// value.
    Tokenize "tokenize" 3..=4 Choice,
    /// URI composed of scheme, host, port, path, query and fragment. Absent parts are empty.
    AnyUri "anyURI" 7..=7 Parts,
    /// Resolves the reference in the second argument against the base URI in the third (RFC 3986, section
    /// 5.2).
    ResolveUri "resolveURI" 3..=3 Function,
    /// Duration composed of years and months.
    YearMonthDuration "yearMonthDuration" 3..=3 Parts,
    /// Duration composed of days, hours, minutes and seconds.
    DayTimeDuration "dayTimeDuration" 5..=5 Parts,
    /// Date and time composed of year, month, day, hour, minute, second and an optional time zone (`Z`,
    /// `+02:00`).
    DateTime "dateTime" 7..=8 Parts,
    /// Date composed of year, month, day and an optional time zone.
    Date "date" 4..=5 Parts,
    /// Time composed of hour, minute, second and an optional time zone.
    Time "time" 4..=5 Parts,
    /// Sum of the second and third argument, both durations in months.
    AddYearMonthDurations "addYearMonthDurations" 3..=3 Function,
    /// Second argument minus the third, both durations in months.
    SubtractYearMonthDurations "subtractYearMonthDurations" 3..=3 Function,
    /// Second argument, a duration in months, times the number in the third; rounded to months.
    MultiplyYearMonthDuration "multiplyYearMonthDuration" 3..=3 Function,
    /// Second argument, a duration in months, divided by the number in the third; rounded to months.
    DivideYearMonthDuration "divideYearMonthDurations" 3..=3 Function,
    /// Sum of the second and third argument, both durations in seconds.
    AddDayTimeDurations "addDayTimeDurations" 3..=3 Function,
    /// Second argument minus the third, both durations in seconds.
    SubtractDayTimeDurations "subtractDayTimeDurations" 3..=3 Function,
    /// Second argument, a duration in seconds, times the number in the third.
    MultiplyDayTimeDuration "multiplyDayTimeDurations" 3..=3 Function,
    /// Second argument, a duration in seconds, divided by the number in the third.
    DivideDayTimeDuration "divideDayTimeDuration" 3..=3 Function,
    /// Second argument minus the third, both dates; the result is a duration.
    SubtractDates "subtractDates" 3..=3 Function,
    /// Second argument minus the third, both times; the result is a duration.
    SubtractTimes "subtractTimes" 3..=3 Function,
    /// Second argument, a date with time, plus the third, a duration in months.
    AddYearMonthDurationToDateTime "addYearMonthDurationToDateTime" 3..=3 Function,
    /// Second argument, a date with time, plus the third, a duration in seconds.
    AddDayTimeDurationToDateTime "addDayTimeDurationToDateTime" 3..=3 Function,
    /// Second argument, a date with time, minus the third, a duration in months.
    SubtractYearMonthDurationFromDateTime "subtractYearMonthDurationFromDateTime" 3..=3 Function,
    /// Second argument, a date with time, minus the third, a duration in seconds.
    SubtractDayTimeDurationFromDateTime "subtractDayTimeDurationFromDateTime" 3..=3 Function,
    /// Second argument, a date, plus the third, a duration in months.
    AddYearMonthDurationToDate "addYearMonthDurationToDate" 3..=3 Function,
    /// Second argument, a date, plus the third, a duration in seconds; rounded down to whole days.
    AddDayTimeDurationToDate "addDayTimeDurationToDate" 3..=3 Function,
    /// Second argument, a date, minus the third, a duration in months.
    SubtractYearMonthDurationFromDate "subtractYearMonthDurationFromDate" 3..=3 Function,
    /// Second argument, a date, minus the third, a duration in seconds; rounded down to whole days.
    SubtractDayTimeDurationFromDate "subtractDayTimeDurationFromDate" 3..=3 Function,
    /// Second argument, a time, plus the third, a duration in seconds; modulo one day.
    AddDayTimeDurationToTime "addDayTimeDurationToTime" 3..=3 Function,
    /// Second argument, a time, minus the third, a duration in seconds; modulo one day.
    SubtractDayTimeDurationFromTime "subtractDayTimeDurationFromTime" 3..=3 Function,
    /// Second argument minus the third, both dates with time, in whole months.
    SubtractDateTimesYieldingYearMonthDuration "subtractDateTimesYieldingYearMonthDuration" 3..=3 Function,
    /// Second argument minus the third, both dates with time, in seconds.
    SubtractDateTimesYieldingDayTimeDuration "subtractDateTimesYieldingDayTimeDuration" 3..=3 Function,
}

const LIST_BUILT_INS: [&str; 9] = [
    "empty",
    "first",
    "length",
    "listConcat",
    "listIntersection",
    "listSubtraction",
    "member",
    "rest",
    "sublist",
];

/// Returns `true` for the local name of a SWRL built-in on lists. The engine rejects these built-ins,
/// because it has no list values.
pub(crate) fn is_refused(local: &str) -> bool {
    LIST_BUILT_INS.contains(&local)
}

impl BuiltIn {
    /// Creates a custom built-in from a definition, for rules that are built in Rust or, by
    /// [`crate::Syntax::built_ins`], for rule texts. A definition lives until the end of the process: it
    /// is a `static` or a leaked box.
    pub fn custom(definition: &'static dyn Definition) -> Self {
        Self::Custom(CustomBuiltIn(definition))
    }

    /// Returns the built-in of `swrlb` with this local name, if there is one.
    pub fn from_name(local: &str) -> Option<Self> {
        let is_swrl = |built_in: &Self| !matches!(built_in, Self::DataRange | Self::OutsideDataRange);
        Self::ALL.iter().copied().find(|built_in| built_in.name() == local && is_swrl(built_in))
    }

    /// Returns `true` if the built-in accepts this number of arguments.
    pub fn accepts(self, count: usize) -> bool {
        match (self, self.shape()) {
            (Self::Custom(custom), _) => count > 0 && custom.definition().accepts(count),
            (_, Some((minimum, maximum, _))) => (minimum..=maximum).contains(&count),
            _ => false,
        }
    }

    /// Returns `true` if the first argument is the one value that is computed from the others, so that it may
    /// be unbound. `false` for `tokenize`, whose first argument is one of several values.
    pub fn is_function(self) -> bool {
        match self {
            Self::Custom(custom) => custom.definition().is_function(),
            _ => matches!(self.shape(), Some((.., Kind::Function | Kind::Parts))),
        }
    }

    /// Returns `true` if the values of the unknown arguments can be computed from the known arguments.
    /// `known` has a flag for each argument.
    pub fn binds(self, known: &[bool]) -> bool {
        let kind = self.shape().map(|(.., kind)| kind);
        let inputs_known = known.get(1..).is_some_and(|inputs_known| inputs_known.iter().all(|known| *known));
        match known.first() {
            _ if known.iter().all(|known| *known) => true,
            Some(false) => inputs_known && (self.is_function() || kind == Some(Kind::Choice)),
            _ => kind == Some(Kind::Parts),
        }
    }
}
