/** Numbers for people: three or four digits, thin spaces between thousands. */

const grouped = new Intl.NumberFormat('en-US', { maximumSignificantDigits: 4 });

export function number(v: number): string {
    return grouped.format(v).replace(/,/g, '\u2009');
}

/** A share in percent, to a tenth. */
export const percentOf = (share: number): string => `${number(Math.round(1000 * share) / 10)} %`;

export function fixed(v: number, digits: number): string {
    return Number.isFinite(v) ? v.toFixed(digits) : '–';
}

/** The end of a range: -1e9 -> "−10⁹" */
export function limit(v: number): string {
    const power = Math.log10(Math.abs(v));
    const text =
        power >= 6 && Number.isInteger(power)
            ? `10${Array.from(String(power), (d) => '⁰¹²³⁴⁵⁶⁷⁸⁹'[Number(d)]).join('')}`
            : number(Math.abs(v));
    return v < 0 ? `−${text}` : text;
}

/** 21300000 -> "21.3 M" */
export function si(v: number): string {
    const steps: [number, string][] = [
        [1e9, 'G'],
        [1e6, 'M'],
        [1e3, 'k'],
    ];
    for (const [unit, letter] of steps) {
        if (v >= unit) return `${Number((v / unit).toPrecision(3))} ${letter}`;
    }
    return `${Number(v.toPrecision(3))} `;
}

/** 125.34 with an error of 4.7 -> 125: digits below the first of the error say nothing. */
export function toError(v: number, error: number): number {
    if (!(error > 0) || !Number.isFinite(error)) return v;
    const unit = 10 ** Math.floor(Math.log10(Number(error.toPrecision(1))));
    return Math.round(v / unit) * unit;
}

/** 0.0123 -> "1.2 %" */
export function percent(v: number): string {
    return `${Number((100 * v).toPrecision(2))} %`;
}

/** Seconds, in what one would say: 0.42 -> "0.4 s", 4000 -> "67 min" */
export function duration(s: number): string {
    if (s < 100) return `${Number(s.toFixed(s < 0.95 ? 1 : 0))} s`;
    return s < 6000 ? `${Math.round(s / 60)} min` : `${Math.round(s / 3600)} h`;
}

export function metres(v: number): string {
    return v.toFixed(Math.abs(v) < 10 ? 3 : 2);
}
