import { useSignal, type ReadonlySignal } from '@preact/signals';
import { useId, useRef } from 'preact/hooks';
import { limit } from '../lib/format';
import { parseQuantity } from '../lib/quantity';

interface Props {
    label: string;
    /** null: of several things, which differ in it. */
    value: number | null;
    unit: string;
    min: number;
    max: number;
    step?: number;
    /** What it means, for who points at it. */
    title?: string;
    onCommit(value: number): void;
    /** A number with another unit; true: it is taken, and not this field's to check. */
    onOther?(value: number, unit: string): boolean;
}

/** On its own: drawing the field anew would put the old value back under the fingers of who types. */
function Reason({ refused, text }: { refused: ReadonlySignal<boolean>; text: string }) {
    return <>{refused.value && text}</>;
}

/**
 * Takes effect on Enter or when left; Escape takes back what was typed, arrow up and down go by a step. What is no number of the
 * range, or has a unit of something else, is refused: the value stays, and the reason shows. While it has the focus it shows what is
 * typed, whatever others do to the value.
 */
export function NumberField({ label, value, unit, min, max, step, title, onCommit, onOther }: Props) {
    const refused = useSignal(false);
    /** null: nothing was typed since it was entered or committed. */
    const draft = useRef<string | null>(null);
    const reasonId = useId();
    const shown = value === null ? '' : String(value);
    const commit = (input: HTMLInputElement): void => {
        if (draft.current === null) return;
        draft.current = null;
        if (value === null && input.value.trim() === '') return;
        const typed = parseQuantity(input.value, unit);
        if (typed && typed.unit !== unit && onOther?.(typed.value, typed.unit)) {
            input.value = shown;
            return;
        }
        const v = typed?.unit === unit ? typed.value : NaN;
        if (v === value) {
            input.value = shown;
            return;
        }
        refused.value = !(v >= min && v <= max);
        if (refused.value) input.value = shown;
        else onCommit(v);
    };
    const stepBy = (n: number, input: HTMLInputElement): void => {
        const typed = parseQuantity(input.value, unit);
        if (typed?.unit !== unit) return;
        const next = Number((typed.value + n * (step ?? 1)).toPrecision(12));
        input.value = draft.current = String(Math.min(max, Math.max(min, next)));
        commit(input);
    };
    const onKeyDown = (e: KeyboardEvent & { currentTarget: HTMLInputElement }): void => {
        if (e.key === 'Enter') commit(e.currentTarget);
        const n = { ArrowUp: 1, ArrowDown: -1 }[e.key];
        if (n !== undefined) {
            e.preventDefault();
            stepBy(n, e.currentTarget);
        }
        if (e.key !== 'Escape' || draft.current === null) return;
        e.stopPropagation();
        draft.current = null;
        e.currentTarget.value = shown;
    };
    return (
        <label class="number" title={title}>
            <span class="number-label">{label}</span>
            <span class="number-box">
                <input
                    type="text"
                    inputMode="decimal"
                    autocomplete="off"
                    spellcheck={false}
                    role="spinbutton"
                    aria-label={label}
                    aria-valuenow={value ?? undefined}
                    aria-valuetext={value === null ? 'mixed' : `${shown} ${unit}`}
                    aria-valuemin={min}
                    aria-valuemax={max}
                    aria-invalid={refused}
                    aria-describedby={reasonId}
                    value={draft.current ?? shown}
                    placeholder={value === null ? 'mixed' : undefined}
                    onFocus={() => (refused.value = false)}
                    onInput={(e) => {
                        refused.value = false;
                        draft.current = e.currentTarget.value;
                    }}
                    onBlur={(e) => commit(e.currentTarget)}
                    onKeyDown={onKeyDown}
                />
                <span class="number-unit" aria-hidden="true">
                    {unit}
                </span>
            </span>
            <small id={reasonId} class="number-reason" role="alert">
                <Reason refused={refused} text={`Not changed: needs a number from ${limit(min)} to ${limit(max)} ${unit}`} />
            </small>
        </label>
    );
}
