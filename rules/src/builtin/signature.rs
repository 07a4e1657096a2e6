//! The built-ins, with how many arguments they take and which of these they compute.
//!
//! [3] RFC 3986: Uniform Resource Identifier, 2005.

use super::custom::{CustomBuiltIn, Definition};

/// The namespace of SWRL's built-ins.
pub const SWRLB: &str = "http://www.w3.org/2003/11/swrlb#";

macro_rules! built_ins {
    ($($(#[$doc:meta])* $variant:ident $name:literal $minimum:literal..=$maximum:literal $kind:ident,)*) => {
        /// A built-in predicate or function on literals.
        #[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
        #[non_exhaustive]
        pub enum BuiltIn {
            $($(#[$doc])* $variant,)*
            /// One that is not SWRL's, see [`BuiltIn::custom`].
            Custom(CustomBuiltIn),
        }

        impl BuiltIn {
            /// Every built-in of the engine itself.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// The local name in the `swrlb` namespace; the IRI of a custom built-in.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                    Self::Custom(custom) => custom.definition().iri(),
                }
            }

            /// The least and greatest number of arguments, and how they come to their values; none of a custom built-in.
            pub(super) fn shape(self) -> Option<(usize, usize, Kind)> {
                match self {
                    $(Self::$variant => Some(($minimum, $maximum, Kind::$kind)),)*
                    Self::Custom(_) => None,
                }
            }
        }
    };
}

/// How arguments come to their values.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// All have to be known.
    Test,
    /// The first is computed from the others.
    Function,
    /// The first is computed from the others, or the others from it: its parts.
    Parts,
    /// The first is any one of several values that the others give.
    Choice,
}

built_ins! {
    /// The first lies in the value space of the datatype whose IRI the second (an `xsd:anyURI`) is: SWRL's data range
    /// atom, not a member of `swrlb`. Rule text writes it `xsd:decimal(?x)`.
    DataRange "dataRange" 2..=2 Test,
    /// The first is a literal that certainly lies outside the datatype's value space: the complement of a data range, which
    /// OWL has and SWRL has not. Rule text writes it `not xsd:decimal(?x)`.
    OutsideDataRange "outsideDataRange" 2..=2 Test,
    /// The values are equal.
    Equal "equal" 2..=2 Test,
    /// The values are comparable and not equal.
    NotEqual "notEqual" 2..=2 Test,
    /// First < second.
    LessThan "lessThan" 2..=2 Test,
    /// First <= second.
    LessThanOrEqual "lessThanOrEqual" 2..=2 Test,
    /// First > second.
    GreaterThan "greaterThan" 2..=2 Test,
    /// First >= second.
    GreaterThanOrEqual "greaterThanOrEqual" 2..=2 Test,
    /// Sum of the second and all further arguments.
    Add "add" 3..=32 Function,
    /// Second minus third.
    Subtract "subtract" 3..=3 Function,
    /// Product of the second and all further arguments.
    Multiply "multiply" 3..=32 Function,
    /// Second divided by third.
    Divide "divide" 3..=3 Function,
    /// Second divided by third, truncated to an integer.
    IntegerDivide "integerDivide" 3..=3 Function,
    /// Remainder of the truncating division.
    Mod "mod" 3..=3 Function,
    /// Second to the power of third.
    Pow "pow" 3..=3 Function,
    /// The second, unchanged.
    UnaryPlus "unaryPlus" 2..=2 Function,
    /// The second, negated.
    UnaryMinus "unaryMinus" 2..=2 Function,
    /// Absolute value.
    Abs "abs" 2..=2 Function,
    /// Smallest integer not below.
    Ceiling "ceiling" 2..=2 Function,
    /// Largest integer not above.
    Floor "floor" 2..=2 Function,
    /// Nearest integer, halves towards positive infinity.
    Round "round" 2..=2 Function,
    /// Nearest value with the third argument's number of fractional digits (0 if absent), halves to even.
    RoundHalfToEven "roundHalfToEven" 2..=3 Function,
    /// Sine of radians.
    Sin "sin" 2..=2 Function,
    /// Cosine of radians.
    Cos "cos" 2..=2 Function,
    /// Tangent of radians.
    Tan "tan" 2..=2 Function,
    /// Negation.
    BooleanNot "booleanNot" 2..=2 Function,
    /// Equal strings, case ignored.
    StringEqualIgnoreCase "stringEqualIgnoreCase" 2..=2 Test,
    /// Concatenation of the second and all further arguments.
    StringConcat "stringConcat" 2..=32 Function,
    /// Characters of the second from the third (counted from 1), as many as the fourth says.
    Substring "substring" 3..=4 Function,
    /// Number of characters.
    StringLength "stringLength" 2..=2 Function,
    /// White space at the ends removed, inside collapsed.
    NormalizeSpace "normalizeSpace" 2..=2 Function,
    /// In upper case.
    UpperCase "upperCase" 2..=2 Function,
    /// In lower case.
    LowerCase "lowerCase" 2..=2 Function,
    /// Characters of the third replaced by those at the same place in the fourth, or removed.
    Translate "translate" 4..=4 Function,
    /// The first contains the second.
    Contains "contains" 2..=2 Test,
    /// The first contains the second, case ignored.
    ContainsIgnoreCase "containsIgnoreCase" 2..=2 Test,
    /// The first starts with the second.
    StartsWith "startsWith" 2..=2 Test,
    /// The first ends with the second.
    EndsWith "endsWith" 2..=2 Test,
    /// The part of the second before the third, empty if it does not occur.
    SubstringBefore "substringBefore" 3..=3 Function,
    /// The part of the second after the third, empty if it does not occur.
    SubstringAfter "substringAfter" 3..=3 Function,
    /// The first matches the regular expression of the second; the third, if any, holds `XPath` flags.
    Matches "matches" 2..=3 Test,
    /// The second, each match of the third's regular expression replaced by the fourth; flags may follow.
    Replace "replace" 4..=5 Function,
    /// One of the substrings of the second between matches of the third's regular expression; flags may follow. SWRL has a
    /// sequence of them, for which the engine has no value.
    Tokenize "tokenize" 3..=4 Choice,
    /// URI of scheme, host, port, path, query and fragment, each empty where there is none.
    AnyUri "anyURI" 7..=7 Parts,
    /// The reference in the second relative to the base in the third (\[3\], section 5.2).
    ResolveUri "resolveURI" 3..=3 Function,
    /// Duration of so many years and months.
    YearMonthDuration "yearMonthDuration" 3..=3 Parts,
    /// Duration of so many days, hours, minutes and seconds.
    DayTimeDuration "dayTimeDuration" 5..=5 Parts,
    /// Moment from year, month, day, hour, minute, second and, if given, time zone (`Z`, `+02:00`).
    DateTime "dateTime" 7..=8 Parts,
    /// Date from year, month, day and, if given, time zone.
    Date "date" 4..=5 Parts,
    /// Time from hour, minute, second and, if given, time zone.
    Time "time" 4..=5 Parts,
    /// Sum of two durations in months.
    AddYearMonthDurations "addYearMonthDurations" 3..=3 Function,
    /// Difference of two durations in months.
    SubtractYearMonthDurations "subtractYearMonthDurations" 3..=3 Function,
    /// A duration in months times a number, rounded to months.
    MultiplyYearMonthDuration "multiplyYearMonthDuration" 3..=3 Function,
    /// A duration in months divided by a number, rounded to months.
    DivideYearMonthDuration "divideYearMonthDurations" 3..=3 Function,
    /// Sum of two durations in seconds.
    AddDayTimeDurations "addDayTimeDurations" 3..=3 Function,
    /// Difference of two durations in seconds.
    SubtractDayTimeDurations "subtractDayTimeDurations" 3..=3 Function,
    /// A duration in seconds times a number.
    MultiplyDayTimeDuration "multiplyDayTimeDurations" 3..=3 Function,
    /// A duration in seconds divided by a number.
    DivideDayTimeDuration "divideDayTimeDuration" 3..=3 Function,
    /// From the third date to the second.
    SubtractDates "subtractDates" 3..=3 Function,
    /// From the third time to the second.
    SubtractTimes "subtractTimes" 3..=3 Function,
    /// A moment so many months later.
    AddYearMonthDurationToDateTime "addYearMonthDurationToDateTime" 3..=3 Function,
    /// A moment so many seconds later.
    AddDayTimeDurationToDateTime "addDayTimeDurationToDateTime" 3..=3 Function,
    /// A moment so many months earlier.
    SubtractYearMonthDurationFromDateTime "subtractYearMonthDurationFromDateTime" 3..=3 Function,
    /// A moment so many seconds earlier.
    SubtractDayTimeDurationFromDateTime "subtractDayTimeDurationFromDateTime" 3..=3 Function,
    /// A date so many months later.
    AddYearMonthDurationToDate "addYearMonthDurationToDate" 3..=3 Function,
    /// A date so much later, in whole days.
    AddDayTimeDurationToDate "addDayTimeDurationToDate" 3..=3 Function,
    /// A date so many months earlier.
    SubtractYearMonthDurationFromDate "subtractYearMonthDurationFromDate" 3..=3 Function,
    /// A date so much earlier, in whole days.
    SubtractDayTimeDurationFromDate "subtractDayTimeDurationFromDate" 3..=3 Function,
    /// A time so much later, around midnight.
    AddDayTimeDurationToTime "addDayTimeDurationToTime" 3..=3 Function,
    /// A time so much earlier, around midnight.
    SubtractDayTimeDurationFromTime "subtractDayTimeDurationFromTime" 3..=3 Function,
    /// Whole months from the third moment to the second.
    SubtractDateTimesYieldingYearMonthDuration "subtractDateTimesYieldingYearMonthDuration" 3..=3 Function,
    /// Seconds from the third moment to the second.
    SubtractDateTimesYieldingDayTimeDuration "subtractDateTimesYieldingDayTimeDuration" 3..=3 Function,
}

/// Members of `swrlb` whose arguments or results are lists.
const REFUSED: [&str; 9] = [
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

/// Whether a local name is SWRL's but works on lists, which the engine has no values for.
pub(crate) fn is_refused(local: &str) -> bool {
    REFUSED.contains(&local)
}

impl BuiltIn {
    /// Makes a built-in of a definition, for rules built as data or for [`crate::Syntax::built_ins`]. Definitions live
    /// as long as the process: a `static`, or a box that is leaked.
    pub fn custom(definition: &'static dyn Definition) -> Self {
        Self::Custom(CustomBuiltIn(definition))
    }

    /// The built-in of `swrlb` with this local name.
    pub fn from_name(local: &str) -> Option<Self> {
        let is_swrls = |built_in: &Self| !matches!(built_in, Self::DataRange | Self::OutsideDataRange);
        Self::ALL.iter().copied().find(|built_in| built_in.name() == local && is_swrls(built_in))
    }

    /// Whether it can take this many arguments.
    pub fn accepts(self, count: usize) -> bool {
        match (self, self.shape()) {
            (Self::Custom(custom), _) => count > 0 && custom.definition().accepts(count),
            (_, Some((minimum, maximum, _))) => (minimum..=maximum).contains(&count),
            _ => false,
        }
    }

    /// Whether the first argument is computed from the others and so may be unbound.
    pub fn is_function(self) -> bool {
        match self {
            Self::Custom(custom) => custom.definition().is_function(),
            _ => matches!(self.shape(), Some((.., Kind::Function | Kind::Parts))),
        }
    }

    /// Whether the arguments that are known give the values of those that are not.
    pub fn binds(self, known: &[bool]) -> bool {
        let kind = self.shape().map(|(.., kind)| kind);
        let rest = known.get(1..).is_some_and(|rest| rest.iter().all(|known| *known));
        match known.first() {
            _ if known.iter().all(|known| *known) => true,
            Some(false) => rest && (self.is_function() || kind == Some(Kind::Choice)),
            _ => kind == Some(Kind::Parts),
        }
    }
}
