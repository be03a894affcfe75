/**
 * Whose a frame is. Frames overtake the reply to view.open that names their view, and echo `camera_seq`, which the client
 * gives: so each of the views that it has open at once counts in a range of its own, of the 32 bits that frames have for it.
 */
const RANGES = {
    /** 0: none was given. */
    view: [1, 2 ** 30],
    reference: [2 ** 30, 2 ** 31],
    stills: [2 ** 31, 3 * 2 ** 30],
    moment: [3 * 2 ** 30, 2 ** 32],
} as const;
export type Viewer = keyof typeof RANGES;

export class CameraNumbers {
    private readonly end: number;
    private from: number;
    /** The number that was given last. */
    last: number;

    constructor(viewer: Viewer) {
        const [from, end] = RANGES[viewer];
        this.from = from;
        this.end = end;
        this.last = from - 1;
    }

    /** For what is sent now. A hand that never rests gives 60 a second, and is at the end after half a year. */
    next(): number {
        return ++this.last;
    }

    /** A view is opened anew: what was numbered before is of another. */
    begin(): void {
        this.from = this.last + 1;
    }

    has(seq: number): boolean {
        return seq >= this.from && seq < this.end;
    }
}
