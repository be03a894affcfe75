/** Colour of light: temperature to linear Rec.709, and linear Rec.709 to and from what a screen shows. */
import type { Vec3 } from './vec';

/** Range of the fit below; cct_k of the protocol has the same. */
export const CCT_MIN = 1667;
export const CCT_MAX = 25000;

/** CIE xy of a black body: Kang et al. 2002, "Design of advanced color temperature control system". */
export function planckianXy(kelvin: number): [number, number] {
    const t = Math.min(CCT_MAX, Math.max(CCT_MIN, kelvin));
    const x =
        t < 4000
            ? -0.2661239e9 / t ** 3 - 0.2343589e6 / t ** 2 + 0.8776956e3 / t + 0.17991
            : -3.0258469e9 / t ** 3 + 2.1070379e6 / t ** 2 + 0.2226347e3 / t + 0.24039;
    let y: number;
    if (t < 2222) y = -1.1063814 * x ** 3 - 1.3481102 * x ** 2 + 2.18555832 * x - 0.20219683;
    else if (t < 4000) y = -0.9549476 * x ** 3 - 1.37418593 * x ** 2 + 2.09137015 * x - 0.16748867;
    else y = 3.081758 * x ** 3 - 5.8733867 * x ** 2 + 3.75112997 * x - 0.37001483;
    return [x, y];
}

/** Linear Rec.709 of luminance 1; a component below the gamut (under 1900 K) is clamped to 0. */
export function cctToLinear(kelvin: number): Vec3 {
    return linearOfXy(...planckianXy(kelvin)).map((v) => Math.max(0, v)) as unknown as Vec3;
}

/** Of luminance 1; a component is negative where the colour is outside of Rec.709. */
function linearOfXy(x: number, y: number): Vec3 {
    const X = x / y;
    const Z = (1 - x - y) / y;
    return [
        3.2404542 * X - 1.5371385 - 0.4985314 * Z,
        -0.969266 * X + 1.8760108 + 0.041556 * Z,
        0.0556434 * X - 0.2040259 + 1.0572252 * Z,
    ];
}

export const luminance = (c: Vec3): number => 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];

/** The same hue at luminance 1, which is how light colours are stored; black has none and becomes white. */
export function unitLuminance(c: Vec3): Vec3 {
    const y = luminance(c);
    return y > 0 ? [c[0] / y, c[1] / y, c[2] / y] : [1, 1, 1];
}

/** sRGB transfer functions, IEC 61966-2-1. */
const encode = (v: number): number => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
const decode = (v: number): number => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);

/** "#rrggbb" of a colour of a surface: 1 is white. */
export function hexOf(c: Vec3): string {
    const hex = (v: number): string =>
        Math.round(255 * encode(Math.min(1, Math.max(0, v))))
            .toString(16)
            .padStart(2, '0');
    return `#${hex(c[0])}${hex(c[1])}${hex(c[2])}`;
}

/** Of the brightest screen colour with this hue. */
export function swatch(c: Vec3): string {
    const top = Math.max(c[0], c[1], c[2]);
    if (!(top > 0) || !Number.isFinite(top)) return '#000000';
    return hexOf([c[0] / top, c[1] / top, c[2] / top]);
}

/** Linear Rec.709 of "#rrggbb". */
export function linearFromHex(hex: string): Vec3 {
    const byte = (at: number): number => decode(parseInt(hex.slice(at, at + 2), 16) / 255);
    return [byte(1), byte(3), byte(5)];
}

/** CIE xy of linear Rec.709; black has that of white. */
export function xyOf(c: Vec3): [number, number] {
    const X = 0.4124564 * c[0] + 0.3575761 * c[1] + 0.1804375 * c[2];
    const Y = 0.2126729 * c[0] + 0.7151522 * c[1] + 0.072175 * c[2];
    const Z = 0.0193339 * c[0] + 0.119192 * c[1] + 0.9503041 * c[2];
    const sum = X + Y + Z;
    return sum > 0 ? [X / sum, Y / sum] : [0.3127, 0.329];
}

/** Linear Rec.709 of luminance 1; clamped where it is outside: the server takes no negative light. */
export function linearFromXy(x: number, y: number): { linear: Vec3; outside: boolean } {
    const raw = linearOfXy(x, y);
    return { linear: unitLuminance(raw.map((v) => Math.max(0, v)) as unknown as Vec3), outside: raw.some((v) => v < -1e-3) };
}
