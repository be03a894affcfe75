import { useRef } from 'preact/hooks';
import type { Scale } from '../lib/scale';

/** Presses that follow each other this fast are one undo step. */
const KEY_PAUSE_MS = 1500;

/** Positions to move by; the ends are a whole range away. */
function keyStep(key: string, { arrow, page }: { arrow: number; page: number }): number | undefined {
    const steps: Record<string, number> = {
        ArrowRight: arrow,
        ArrowUp: arrow,
        ArrowLeft: -arrow,
        ArrowDown: -arrow,
        PageUp: page,
        PageDown: -page,
        Home: -1,
        End: 1,
    };
    return steps[key];
}

interface Props {
    label: string;
    scale: Scale;
    value: number;
    /** What assistive technology says, as "800 lumens". */
    spoken: string;
    class?: string;
    /** A value to find again, which gets a tick; null: none. */
    mark?: number | null;
    /** How far the keys go, in positions of the scale; absent: as the browser has it. */
    steps?: { arrow: number; page: number };
    /** Between the positions at which it can stand; absent: anywhere. */
    grid?: number;
    disabled?: boolean;
    tabIndex?: number;
    /** The id of a sentence about it. */
    describedBy?: string;
    onInput(value: number): void;
    /** The pointer let go, or a key press is over. */
    onEnd(): void;
}

export function Slider({ label, scale: now, value, spoken, class: extra, mark, steps: stepsNow, grid, disabled, tabIndex, describedBy, onInput, onEnd }: Props) {
    const pause = useRef(0);
    // For the length of a gesture the scale and the steps stay: those that follow the value would run away under the hand.
    const held = useRef<{ scale: Scale; steps: Props['steps'] } | null>(null);
    const { scale, steps } = held.current ?? { scale: now, steps: stepsNow };
    const position = scale.toPosition(value);
    const finish = (): void => {
        clearTimeout(pause.current);
        held.current = null;
        onEnd();
    };
    const onKey = (e: KeyboardEvent): void => {
        const step = steps && keyStep(e.key, steps);
        if (step === undefined || e.ctrlKey || e.altKey || e.metaKey) return;
        e.preventDefault();
        held.current ??= { scale, steps };
        clearTimeout(pause.current);
        pause.current = setTimeout(finish, KEY_PAUSE_MS) as unknown as number;
        onInput(scale.toValue(Math.min(1, Math.max(0, position + step))));
    };
    const onPointerDown = (): void => {
        finish();
        held.current = { scale: now, steps: stepsNow };
    };
    const input = (
        <input
            type="range"
            class={`slider ${extra ?? ''}`}
            min="0"
            max="1"
            step={grid ?? 0.001}
            disabled={disabled}
            tabIndex={tabIndex}
            data-column="slider"
            aria-describedby={describedBy}
            value={position}
            aria-label={label}
            aria-valuetext={spoken}
            style={{ '--fill': `${(100 * position).toFixed(1)}%` }}
            onKeyDown={onKey}
            onPointerDown={onPointerDown}
            onBlur={finish}
            onInput={(e) => onInput(scale.toValue(e.currentTarget.valueAsNumber))}
            onChange={finish}
        />
    );
    return (
        <span class="slider-box">
            {mark != null && <span class="slider-mark" style={{ '--at': scale.toPosition(mark).toFixed(4) }} />}
            {input}
        </span>
    );
}
