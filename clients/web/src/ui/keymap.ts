/** One table: what the keys do and what the help says about them. */
import type { App } from '../state/app';
import { isOn } from '../state/lights';
import { STOP_NAMES } from '../state/view';
import { pan, turn, zoom } from '../view/camera';

interface Key {
    /** Values of KeyboardEvent.key, lower case. */
    keys: readonly string[];
    shown: string;
    label: string;
    /** True: only with Shift, false: only without, absent: either (the key itself says it, as "?" does). */
    shift?: boolean;
    run(app: App, key: string): void;
}

const TURN = (5 * Math.PI) / 180;
const PAN = 0.05;
const EV = 1 / 3;

const ARROWS: Record<string, [number, number]> = {
    arrowleft: [-1, 0],
    arrowright: [1, 0],
    arrowup: [0, 1],
    arrowdown: [0, -1],
};

function expose(app: App, step: number): void {
    const { ev } = app.exposure.value;
    app.view.change({ exposure: { auto: false, ev: Math.round((ev + step) * 30) / 30 } });
}

function stopAt(app: App, step: number): void {
    const stop = STOP_NAMES[STOP_NAMES.indexOf(app.view.settings.value.stop) + step];
    if (stop && app.method.value?.addsSamples) app.view.change({ stop });
}

function nextMap(app: App): void {
    const maps = ['none', 'luminance', 'error'] as const;
    const now = maps.findIndex((m) => m === app.view.settings.value.overlay);
    app.view.change({ overlay: maps[(now + 1) % maps.length]! });
}

function toggleSelected(app: App): void {
    const light = app.selectedLight.value ? app.scene.peek(app.selectedLight.value) : undefined;
    if (light) app.edits.setOnce(light.id, '/on', !isOn(light));
}

export const KEYMAP: readonly Key[] = [
    {
        keys: Object.keys(ARROWS),
        shift: false,
        shown: '← ↑ → ↓',
        label: 'Orbit',
        run: (app, key) => app.view.moveTo(turn(app.view.orbit.value, ARROWS[key]![0] * TURN, ARROWS[key]![1] * TURN)),
    },
    {
        keys: Object.keys(ARROWS),
        shift: true,
        shown: 'Shift + arrows',
        label: 'Pan',
        run: (app, key) => app.view.moveTo(pan(app.view.orbit.value, -ARROWS[key]![0] * PAN, ARROWS[key]![1] * PAN)),
    },
    { keys: ['+', '='], shown: '+', label: 'Move closer', run: (app) => app.view.moveTo(zoom(app.view.orbit.value, 1 / 1.1)) },
    { keys: ['-', '_'], shown: '−', label: 'Move away', run: (app) => app.view.moveTo(zoom(app.view.orbit.value, 1.1)) },
    { keys: ['f'], shown: 'F', label: 'Frame what is selected', run: (app) => app.frameSelection() },
    { keys: ['h'], shown: 'H', label: 'Back to the scene’s camera', run: (app) => app.goHome() },
    { keys: ['z'], shift: false, shown: 'Z or Ctrl + Z', label: 'Undo', run: (app) => void app.edits.undo() },
    { keys: ['z'], shift: true, shown: 'Shift + Z or Ctrl + Y', label: 'Redo', run: (app) => void app.edits.redo() },
    { keys: ['o'], shown: 'O', label: 'Selected light on or off', run: toggleSelected },
    { keys: ['s'], shown: 'S', label: 'Solo the selected light', run: (app) => app.selectedLight.value && app.toggleSolo([app.selectedLight.value]) },
    { keys: ['['], shown: '[', label: 'Darker by a third', run: (app) => expose(app, EV) },
    { keys: [']'], shown: ']', label: 'Brighter by a third', run: (app) => expose(app, -EV) },
    { keys: ['c'], shown: 'C', label: 'Luminance in false colour, then the error, then neither', run: nextMap },
    { keys: [','], shown: ',', label: 'Stop refining earlier: faster', run: (app) => stopAt(app, -1) },
    { keys: ['.'], shown: '.', label: 'Refine further: more exact', run: (app) => stopAt(app, 1) },
    { keys: ['l'], shown: 'L', label: 'Show or hide lamp markers', run: (app) => (app.markers.value = !app.markers.value) },
    { keys: ['escape'], shown: 'Esc', label: 'Select nothing', run: (app) => app.clearSelection() },
    { keys: ['?'], shown: '?', label: 'This help', run: (app) => (app.helpOpen.value = true) },
];

export const POINTERS: readonly [string, string][] = [
    ['Drag', 'Orbit'],
    ['Ctrl + drag', 'Look around'],
    ['Right drag', 'Pan; so does Shift + drag'],
    ['Wheel, pinch', 'Move closer or away'],
    ['Click', 'What is there, and its illuminance'],
    ['Double click', 'Turn about that point'],
    ['Drag a mark', 'Move the lamp or the clicked object along the picture'],
    ['Shift + drag it', 'Move it at its height'],
];

/** Fields take their own keys; sliders and lists only the arrows and the like. */
function belongsToControl(target: EventTarget | null, key: string): boolean {
    if (!(target instanceof HTMLElement)) return false;
    if (target.matches('input[type=range], select, summary, button')) return key.length > 1 && key !== 'escape';
    return target.matches('input, textarea');
}

/** True: the key meant something. */
export function handleKey(app: App, e: KeyboardEvent): boolean {
    const key = e.key.toLowerCase();
    if (e.altKey || e.isComposing) return false;
    if (e.ctrlKey || e.metaKey) {
        if (key !== 'z' && key !== 'y') return false;
        if (e.target instanceof HTMLElement && e.target.matches('input[type=text], input[type=search], input[type=number]')) return false;
        void (key === 'y' || e.shiftKey ? app.edits.redo() : app.edits.undo());
        return true;
    }
    if (belongsToControl(e.target, key)) return false;
    const entry = KEYMAP.find((k) => k.keys.includes(key) && (k.shift === undefined || k.shift === e.shiftKey));
    entry?.run(app, key);
    return entry !== undefined;
}
