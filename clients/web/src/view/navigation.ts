/**
 * Pointers on the picture. Left drag orbits, in a room it looks around, with Ctrl the other of the two; right or
 * middle drag and Shift pan, the wheel and a pinch zoom, or walk in a room, two fingers pan; a press without movement is a click.
 */
import { approach, look, pan, turn, turnsHead, type Orbit } from './camera';

export interface NavigationHost {
    orbit(): Orbit;
    /** How far things are around an eye in a room; null: it is in none. */
    room(): number | null;
    moveTo(orbit: Orbit): void;
    /** Places are fractions of the picture. */
    onClick(x: number, y: number, e: PointerEvent): void;
    onDoubleClick(x: number, y: number): void;
}

/** Half a turn for a drag over the height of the picture. */
const TURN_PER_HEIGHT = Math.PI;
/** About the vertical field of view of a usual camera: what is under the pointer stays there. */
const LOOK_PER_HEIGHT = Math.PI / 4;
/** A notch of a usual wheel (120 units) is a step of 15 %. */
const ZOOM_PER_UNIT = Math.log(1.15) / 120;
const UNITS_PER_LINE = 40;
/** Hands tremble: less than this many pixels is a click. */
const CLICK_SLOP = 5;

interface Contact {
    x: number;
    y: number;
}

export class Navigation {
    private readonly contacts = new Map<number, Contact>();
    private travelled = 0;
    private mode: 'orbit' | 'look' | 'pan' = 'orbit';

    constructor(
        private readonly element: HTMLElement,
        private readonly host: NavigationHost,
    ) {
        element.addEventListener('pointerdown', (e) => this.down(e));
        element.addEventListener('pointermove', (e) => this.move(e));
        element.addEventListener('pointerup', (e) => this.up(e));
        element.addEventListener('pointercancel', (e) => this.contacts.delete(e.pointerId));
        element.addEventListener('wheel', (e) => this.wheel(e), { passive: false });
        element.addEventListener('dblclick', (e) => host.onDoubleClick(...this.place(e)));
        element.addEventListener('contextmenu', (e) => e.preventDefault());
    }

    private down(e: PointerEvent): void {
        this.element.setPointerCapture(e.pointerId);
        if (this.contacts.size === 0) this.travelled = 0;
        this.contacts.set(e.pointerId, { x: e.clientX, y: e.clientY });
        if (e.button === 1 || e.button === 2 || e.shiftKey) this.mode = 'pan';
        else this.mode = turnsHead(this.host.room(), e.ctrlKey) ? 'look' : 'orbit';
        if (this.contacts.size > 1) this.travelled = Infinity; // two fingers never click
    }

    private move(e: PointerEvent): void {
        const contact = this.contacts.get(e.pointerId);
        if (!contact) return;
        const dx = e.clientX - contact.x;
        const dy = e.clientY - contact.y;
        this.travelled += Math.hypot(dx, dy);
        if (this.travelled < CLICK_SLOP) return;
        const before = this.spread();
        this.contacts.set(e.pointerId, { x: e.clientX, y: e.clientY });
        const height = this.element.clientHeight;
        const fingers = this.contacts.size;
        let orbit = this.host.orbit();
        if (fingers > 1) orbit = approach(orbit, this.host.room(), before / Math.max(1, this.spread()));
        if (fingers > 1 || this.mode === 'pan') orbit = pan(orbit, dx / height / fingers, dy / height / fingers);
        else if (this.mode === 'look') orbit = look(orbit, (-dx / height) * LOOK_PER_HEIGHT, (dy / height) * LOOK_PER_HEIGHT);
        else orbit = turn(orbit, (-dx / height) * TURN_PER_HEIGHT, (dy / height) * TURN_PER_HEIGHT);
        this.host.moveTo(orbit);
    }

    private up(e: PointerEvent): void {
        if (!this.contacts.delete(e.pointerId)) return;
        if (this.travelled < CLICK_SLOP && e.button === 0) this.host.onClick(...this.place(e), e);
    }

    private wheel(e: WheelEvent): void {
        e.preventDefault();
        const units = e.deltaY * (e.deltaMode === WheelEvent.DOM_DELTA_LINE ? UNITS_PER_LINE : 1);
        // A pinch on a touch pad arrives as a wheel with Ctrl and small steps.
        this.host.moveTo(approach(this.host.orbit(), this.host.room(), Math.exp(units * ZOOM_PER_UNIT * (e.ctrlKey ? 8 : 1))));
    }

    /** Distance between the first two fingers. */
    private spread(): number {
        const [a, b] = [...this.contacts.values()];
        return a && b ? Math.max(1, Math.hypot(a.x - b.x, a.y - b.y)) : 1;
    }

    private place(e: MouseEvent): [number, number] {
        const box = this.element.getBoundingClientRect();
        return [(e.clientX - box.left) / box.width, (e.clientY - box.top) / box.height];
    }
}
