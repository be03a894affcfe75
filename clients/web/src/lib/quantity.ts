/** Numbers as people type them, with or without a unit: "80 cm", "2,5m", "1.2 klm". */

export interface Quantity {
    value: number;
    /** As the field has it, where it is one that can be told in that; else as it was typed, in small letters. */
    unit: string;
}

/** What one of it is in the unit that fields have. */
const UNITS: Record<string, readonly [number, string]> = {
    mm: [0.001, 'm'],
    cm: [0.01, 'm'],
    m: [1, 'm'],
    km: [1000, 'm'],
    in: [0.0254, 'm'],
    '"': [0.0254, 'm'],
    ft: [0.3048, 'm'],
    "'": [0.3048, 'm'],
    deg: [1, '°'],
    rad: [180 / Math.PI, '°'],
    klm: [1000, 'lm'],
    kcd: [1000, 'cd'],
    klx: [1000, 'lx'],
    'cd/m2': [1, 'cd/m²'],
    x: [1, '×'],
};

/** null: no number. unit: of the field, which stands for none. */
export function parseQuantity(text: string, unit: string): Quantity | null {
    const match = /^([-+−]?[\d.,]+(?:e[-+]?\d+)?)(.*)$/i.exec(text.replace(/\s/g, ''));
    if (!match) return null;
    const digits = match[1]!.replace('−', '-');
    // A comma before three digits is 1.2 to some, and 1200 to others.
    if (/^[-+]?[1-9]\d{0,2},\d{3}$/.test(digits)) return null;
    const number = Number(digits.replace(',', '.'));
    if (!Number.isFinite(number)) return null;
    const typed = match[2]!.toLowerCase();
    if (typed === '' || typed === unit.toLowerCase()) return { value: number, unit };
    const [factor, base] = UNITS[typed] ?? [1, typed];
    return { value: Number((number * factor).toPrecision(12)), unit: base };
}
