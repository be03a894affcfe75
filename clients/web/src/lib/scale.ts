/** Sliders whose steps feel even: position 0..1 to value and back. */

export interface Scale {
    toValue(position: number): number;
    toPosition(value: number): number;
}

const clamp01 = (v: number): number => Math.min(1, Math.max(0, v));

/** Logarithmic from min to max, with 0 itself at the very left: a dimmer goes out. */
export function logScale(min: number, max: number): Scale {
    const decades = Math.log(max / min);
    return {
        toValue: (p) => (p <= 0 ? 0 : threeDigits(min * Math.exp(decades * clamp01(p)))),
        toPosition: (v) => (v > 0 ? clamp01(Math.log(v / min) / decades) : 0),
    };
}

/** Even in mired (10^6 / K), in which equal steps look equal (Judd 1933). Left is warm. */
export function kelvinScale(min: number, max: number): Scale {
    const warm = 1e6 / min;
    const cool = 1e6 / max;
    return {
        toValue: (p) => Math.round(1e6 / (warm + (cool - warm) * clamp01(p)) / 10) * 10,
        toPosition: (k) => clamp01((1e6 / k - warm) / (cool - warm)),
    };
}

/** left may be the larger one. */
export function linearScale(left: number, right: number, stepsPerUnit: number): Scale {
    return {
        toValue: (p) => Math.round((left + (right - left) * clamp01(p)) * stepsPerUnit) / stepsPerUnit,
        toPosition: (v) => clamp01((v - left) / (right - left)),
    };
}

/** What a person would type: nobody dims to 813.2847 lm. */
export function threeDigits(v: number): number {
    return Number(v.toPrecision(3));
}
