/** One table: what the keys do and what the help says about them. */
import { signal } from '@preact/signals';
import { recall, remember } from '../lib/store';
import type { App } from '../state/app';
import type { SceneRecord } from '../protocol/types';
import { canPointAt } from '../state/lamp_make';
import { STOP_NAMES } from '../state/view';
import { approach, look, pan, turn, turnsHead } from '../view/camera';

interface Key {
    /** Values of KeyboardEvent.key, lower case. */
    keys: readonly string[];
    shown: string;
    label: string;
    /** True: only with Shift, false: only without, absent: either (the key itself says it, as "?" does). */
    shift?: boolean;
    /** With Ctrl, or Cmd; else without. */
    ctrl?: true;
    /** Only while the picture has the focus. */
    stage?: true;
    run(app: App, key: string): void;
}

const TURN = (5 * Math.PI) / 180;
const LOOK = (3 * Math.PI) / 180;
const PAN = 0.05;
const EV = 1 / 3;

const ARROWS: Record<string, [number, number]> = {
    arrowleft: [-1, 0],
    arrowright: [1, 0],
    arrowup: [0, 1],
    arrowdown: [0, -1],
};

function swing(app: App, key: string, other: boolean): void {
    const [x, y] = ARROWS[key]!;
    const orbit = app.view.orbit.value;
    app.view.moveTo(turnsHead(app.surroundings.room.value, other) ? look(orbit, x * LOOK, y * LOOK) : turn(orbit, x * TURN, y * TURN));
}

const come = (app: App, factor: number): void => app.view.moveTo(approach(app.view.orbit.value, app.surroundings.room.value, factor));

function expose(app: App, step: number): void {
    const { ev } = app.exposure.value;
    app.view.change({ exposure: { auto: false, ev: Math.round((ev + step) * 30) / 30 } });
}

function stopAt(app: App, step: number): void {
    const stop = STOP_NAMES[STOP_NAMES.indexOf(app.view.settings.value.stop) + step];
    if (stop && app.method.value?.addsSamples) app.view.change({ stop });
}

function nextMap(app: App): void {
    const maps = ['none', 'luminance', 'illuminance', 'error'] as const;
    const now = maps.findIndex((m) => m === app.view.settings.value.overlay);
    app.view.change({ overlay: maps[(now + 1) % maps.length]! });
}

const selectedLamp = (app: App): SceneRecord | undefined => {
    const id = app.lamps.selected.value;
    return id ? app.scene.peek(id) : undefined;
};

function withSelected(app: App, act: () => unknown): void {
    if (app.selection.ids.value.length > 0) void act();
    else app.toasts.announce('No lamp is selected');
}

function aim(app: App): void {
    const light = selectedLamp(app);
    if (light && canPointAt(light)) app.lamps.aiming.value = light.id;
}

export const KEYMAP: readonly Key[] = [
    {
        keys: Object.keys(ARROWS),
        shift: false,
        shown: '← ↑ → ↓',
        label: 'Orbit; in a room, look around',
        run: (app, key) => swing(app, key, false),
    },
    {
        keys: Object.keys(ARROWS),
        shift: true,
        shown: 'Shift + arrows',
        label: 'Pan',
        run: (app, key) => app.view.moveTo(pan(app.view.orbit.value, -ARROWS[key]![0] * PAN, ARROWS[key]![1] * PAN)),
    },
    {
        keys: Object.keys(ARROWS),
        ctrl: true,
        stage: true,
        shown: 'Ctrl + arrows',
        label: 'The other of the two, where the picture has the focus',
        run: (app, key) => swing(app, key, true),
    },
    {
        keys: ['enter'],
        stage: true,
        shift: false,
        shown: 'Enter',
        label: 'There: what is in its middle, and its illuminance',
        run: (app) => void app.inspect(0.5, 0.5),
    },
    {
        keys: ['enter'],
        stage: true,
        shift: true,
        shown: 'Shift + Enter',
        label: 'There: turn about its middle',
        run: (app) => void app.lookAt(0.5, 0.5),
    },
    { keys: ['+', '='], shown: '+', label: 'Move closer', run: (app) => come(app, 1 / 1.1) },
    { keys: ['-', '_'], shown: '−', label: 'Move away', run: (app) => come(app, 1.1) },
    { keys: ['f'], shown: 'F', label: 'Frame what is selected', run: (app) => app.frameSelection() },
    { keys: ['h'], shown: 'H', label: 'Back to the scene’s camera', run: (app) => app.goHome() },
    { keys: ['z'], shift: false, shown: 'Z or Ctrl + Z', label: 'Undo', run: (app) => void app.undo() },
    { keys: ['z'], shift: true, shown: 'Shift + Z or Ctrl + Y', label: 'Redo', run: (app) => void app.redo() },
    { keys: ['z'], ctrl: true, shift: false, shown: '', label: '', run: (app) => void app.undo() },
    { keys: ['z'], ctrl: true, shift: true, shown: '', label: '', run: (app) => void app.redo() },
    { keys: ['y'], ctrl: true, shown: '', label: '', run: (app) => void app.redo() },
    { keys: ['d'], ctrl: true, shown: 'Ctrl + D', label: 'Copy what is selected', run: (app) => withSelected(app, () => app.selection.duplicate()) },
    { keys: ['delete'], shown: 'Delete', label: 'Remove what is selected', run: (app) => withSelected(app, () => app.selection.remove()) },
    { keys: ['a'], shown: 'A', label: 'Aim the selected lamp: at what is picked next', run: aim },
    { keys: ['o'], shown: 'O', label: 'Selected lights on or off', run: (app) => withSelected(app, () => app.selection.switchAll()) },
    { keys: ['s'], shown: 'S', label: 'Solo the selected lights', run: (app) => withSelected(app, () => app.selection.solo()) },
    { keys: ['['], shown: '[', label: 'Darker by a third', run: (app) => expose(app, EV) },
    { keys: [']'], shown: ']', label: 'Brighter by a third', run: (app) => expose(app, -EV) },
    { keys: ['c'], shown: 'C', label: 'Luminance in false colour, then illuminance, then the error, then none of them', run: nextMap },
    { keys: ['k'], shown: 'K', label: 'Keep this picture, to compare with it later', run: (app) => void app.compare.keep() },
    { keys: ['w'], shown: 'W', label: 'Wipe between it, or how it was before your last change, and now; arrow keys move the line, Enter flips', run: (app) => app.compare.toggle() },
    { keys: ['t'], shown: 'T', label: 'Timeline: what the scene was; arrow keys go from moment to moment', run: (app) => (app.pastOpen.value = true) },
    { keys: [','], shown: ',', label: 'Stop refining earlier: faster', run: (app) => stopAt(app, -1) },
    { keys: ['.'], shown: '.', label: 'Refine further: more exact', run: (app) => stopAt(app, 1) },
    { keys: ['x'], shown: 'X', label: 'Snapping to the grid, and angles, on or off', run: (app) => (app.snap.on.value = !app.snap.on.value) },
    { keys: ['l'], shown: 'L', label: 'Show or hide lamp markers', run: (app) => (app.markers.value = !app.markers.value) },
    { keys: ['escape'], shown: 'Esc', label: 'Select nothing', run: (app) => app.clearSelection() },
    { keys: ['?'], shown: '?', label: 'This help', run: (app) => (app.helpOpen.value = true) },
];

export const POINTERS: readonly [string, string][] = [
    ['Drag', 'Orbit; in a room, look around'],
    ['Ctrl + drag', 'The other of the two'],
    ['Right drag', 'Pan; so does Shift + drag'],
    ['Wheel, pinch', 'Move closer or away; in a room, walk'],
    ['Click', 'What is there, and its illuminance'],
    ['Ctrl + click, Shift + click', 'Select it, too: in the picture, and in the list, where Shift takes all between'],
    ['Double click', 'Turn about that point'],
    ['Drag a mark', 'Move the lamp or the clicked object along the picture'],
    ['Shift + drag it', 'Move it at its height'],
    ['Ctrl + drag it', 'By the steps of the grid; freely, where snapping is on'],
];

/** Off: keys of one character act only while the picture has the focus. For those who speak to their machine. */
const KEY = 'lumend.letters';
export const letterKeys = signal(recall('localStorage', KEY) !== 'off');

export function setLetterKeys(on: boolean): void {
    letterKeys.value = on;
    remember('localStorage', KEY, on ? 'on' : 'off');
}

/** Fields take all keys, and lists too: a letter finds an entry. Sliders and buttons take those that move or press. */
function belongsToControl(target: EventTarget | null, key: string, ctrl: boolean): boolean {
    if (!(target instanceof Element)) return false;
    if (target.matches('input[type=range], [role=slider], summary, button, [role=button]')) return key.length > 1 && key !== 'escape' && key !== 'delete';
    if (target.matches('select')) return key !== 'escape' && !ctrl;
    return target.matches('input[type=checkbox], input[type=color]') ? key === ' ' || key === 'enter' : target.matches('input, textarea');
}

/** True: the key meant something. */
export function handleKey(app: App, e: KeyboardEvent): boolean {
    const key = e.key.toLowerCase();
    const ctrl = e.ctrlKey || e.metaKey;
    if (e.altKey || e.isComposing || belongsToControl(e.target, key, ctrl)) return false;
    const onStage = e.target instanceof Element && e.target.matches('.stage');
    const entry = KEYMAP.find(
        (k) =>
            k.keys.includes(key) &&
            (k.ctrl ?? false) === ctrl &&
            (k.shift === undefined || k.shift === e.shiftKey) &&
            (onStage || (!k.stage && (letterKeys.value || ctrl || key.length > 1))),
    );
    entry?.run(app, key);
    return entry !== undefined;
}
