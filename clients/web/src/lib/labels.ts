/** Names over a picture: where two would lie over each other, one gives way. */
export interface Label {
    /** The middle of its line, in pixels. */
    x: number;
    y: number;
    text: string;
}

/** Of the letters of names, bold and 12 pixels high, with their rim: few are wider. */
const LETTER_W = 7.5;
const LINE_H = 17;

const width = (text: string): number => LETTER_W * text.length;

/** Which of them have room. The first goes before the later; null: it is not in the picture. */
export function withRoom(labels: readonly (Label | null)[]): Set<number> {
    const kept = new Set<number>();
    labels.forEach((label, i) => {
        if (!label) return;
        for (const k of kept) {
            const other = labels[k]!;
            const near = Math.abs(other.x - label.x) < (width(other.text) + width(label.text)) / 2;
            if (near && Math.abs(other.y - label.y) < LINE_H) return;
        }
        kept.add(i);
    });
    return kept;
}
