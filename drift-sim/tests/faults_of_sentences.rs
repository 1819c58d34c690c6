//! What no sentence may say: numbers that its own interval does not carry, digits that nobody reads, nothing as if it were something.

/// Why a text must not be shown; `None` where nothing is wrong with it.
pub fn fault(text: &str) -> Option<String> {
    // As a terminal without other signs writes them.
    let text = text.replace('\u{a0}', "").replace("+-", "\u{b1}").replace("->", "\u{2192}");
    let words: Vec<&str> = text.split([' ', '(', ')', ',', ';', ':']).filter(|w| !w.is_empty()).collect();
    let number = |word: &str| word.trim_end_matches(['.', '%']).replace('\u{2212}', "-").parse::<f64>().ok();
    for word in &words {
        let bare = word.trim_end_matches(['.', '%']);
        if bare.parse::<f64>().is_ok() && bare.contains('e') {
            return Some(format!("an exponent: {word}"));
        }
        let is_less_than_nothing = bare.starts_with(['-', '\u{2212}']) && number(bare) == Some(0.0);
        if ["NaN", "inf", "-inf"].contains(&bare) || is_less_than_nothing {
            return Some(format!("no number: {word}"));
        }
        let digits = bare.trim_start_matches(['-', '0', '.']).chars().filter(char::is_ascii_digit).count();
        if bare.contains('.') && number(word).is_some() && digits > 7 {
            return Some(format!("{digits} digits: {word}"));
        }
    }
    for unit in ["drive unit", "speed unit", "position unit", "y unit", "u unit"] {
        if text.contains(unit) {
            return Some(format!("a unit that nobody knows: {unit}"));
        }
    }
    for pair in words.windows(2) {
        if let [number_of_them, of] = pair
            && *number_of_them == "1"
            && SEVERAL.contains(&of.trim_end_matches('.'))
        {
            return Some(format!("one of several: {number_of_them} {of}"));
        }
        if let [a, "\u{b1}"] = pair
            && number(a) == Some(0.0)
        {
            return Some(format!("nothing, with an interval: {a} \u{b1}"));
        }
        if let ["by", size] = pair
            && number(size) == Some(0.0)
        {
            return Some(format!("a size of nothing: by {size}"));
        }
        if let [a, b] = pair
            && *a == "+"
            && number(b).is_some_and(|b| b < 0.0)
        {
            return Some(format!("plus a negative number: {a} {b}"));
        }
        if let [a, "sigma"] = pair
            && number(a).is_some_and(|a| a.abs() > 100.0)
        {
            return Some(format!("far outside, with digits: {a} sigma"));
        }
    }
    for four in words.windows(4) {
        if let [a, "%", "to", b] = four
            && number(a).is_some()
            && number(a) == number(b)
        {
            return Some(format!("from a number to the same: {a} % to {b} %"));
        }
    }
    for triple in words.windows(3) {
        match triple {
            [a, "%", "later"] if number(a).is_some_and(|a| a >= 100.0) => {
                return Some(format!("in per cent what is several times: {a} % later"));
            }
            [a, "to" | "\u{2192}", b] if number(a).is_some() && number(a) == number(b) => {
                return Some(format!("from a number to the same: {a} to {b}"));
            }
            [a, "\u{b1}", b] if decimals(a) > decimals(b) => {
                return Some(format!("more digits than the interval: {a} \u{b1} {b}"));
            }
            _ => {}
        }
    }
    None
}

/// What is counted, in the plural.
const SEVERAL: [&str; 13] = [
    "rows",
    "samples",
    "columns",
    "windows",
    "stretches",
    "gaps",
    "times",
    "alarms",
    "decisions",
    "recordings",
    "sigmas",
    "warnings",
    "days",
];

/// Significant digits.
fn significant(word: &str) -> usize {
    let digits = word.trim_start_matches(['-', '\u{2212}', '0', '.']);
    digits.chars().filter(char::is_ascii_digit).count()
}

/// A number on a terminal with more than five digits and no interval that carries them.
pub fn unread_digits(line: &str) -> Option<String> {
    let line = line.replace("+-", "\u{b1}").replace(['(', ')', ',', ';', ':'], " ");
    let words: Vec<&str> = line.split_whitespace().collect();
    let carries = |at: Option<usize>| {
        at.and_then(|at| words.get(at)).is_some_and(|word| ["\u{b1}", "to"].contains(word))
    };
    let per_cent = words.windows(2).find(|pair| {
        let is_far_from_all = |text: &str| text.parse::<f64>().is_ok_and(|x| x.abs() < 99.0);
        pair[1].trim_end_matches('.') == "%" && is_far_from_all(pair[0]) && significant(pair[0]) > 3
    });
    if let Some(pair) = per_cent {
        return Some(format!("more than a person reads of per cent: {} %", pair[0]));
    }
    let long = words.iter().enumerate().find(|(at, word)| {
        let word = word.trim_end_matches(['.', '%']);
        word.contains('.')
            && word.parse::<f64>().is_ok()
            && significant(word) > 5
            && !carries(at.checked_add(1))
            && !carries(at.checked_sub(1))
    });
    long.map(|(_, word)| format!("digits that nobody reads: {word}"))
}

fn decimals(word: &str) -> usize {
    word.split_once('.').map_or(0, |(_, decimals)| decimals.chars().take_while(char::is_ascii_digit).count())
}

/// The checks find what they are there for: what pages have said before.
#[test]
fn what_must_not_be_said_is_found() {
    for bad in [
        "The physics improves the fit by 0.00 to 0.00 points.",
        "It differs by 1.308e-11 %.",
        "It drifts by 5.8e-7 degC/s.",
        "from 95.6 % to 95.6 %",
        "2.668 + -3615 x",
        "effort high 4497.0 sigma",
        "20.812345 \u{b1} 0.4 N",
        "it is 0.123456789 V",
        "a load of -0 N",
        "gains -0.0 in log-likelihood over the refitted model",
        "level 0.0147 drive unit",
        "to find a shift of 1 sigma, 381 % later than with exact knowledge",
        "slip_jump 0.00 +- 0.12",
        "offset: 0 \u{b1} 23",
        "The valve sticks until u is 1.56 away from it, then jumps by 0.",
        "note: 1 rows repeat a time stamp",
    ] {
        assert!(fault(bad).is_some(), "{bad}");
    }
    for good in [
        "20.8 \u{b1} 0.4 N",
        "87\u{a0}480 s (24.3 h)",
        "89.8 \u{2192} 97.4 %",
        "5.8\u{d7}10\u{207b}\u{2077} V",
        "2 \u{2212} 3615 x",
        "26 % later than with exact knowledge",
        "4.8 times as long as with exact knowledge",
        "99.98 % fit",
        "offset: within 23 of 0",
        "1 row repeats a time stamp",
    ] {
        assert_eq!(fault(good), None, "{good}");
    }
    for bad in ["22 correlation times of e, u or r (151.1955 s)", "it misses u by 26.17 % of its deviation"] {
        assert!(unread_digits(bad).is_some(), "{bad}");
    }
    for good in ["kp: 3.99666 +- 0.00013", "20.4012 to 21.2034", "(151 s)", "17.54 h from t = 3600 s"] {
        assert_eq!(unread_digits(good), None, "{good}");
    }
}
