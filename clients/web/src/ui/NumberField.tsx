import { useSignal, type ReadonlySignal } from '@preact/signals';
import { useId, useRef } from 'preact/hooks';
import { limit } from '../lib/format';

interface Props {
    label: string;
    value: number;
    unit: string;
    min: number;
    max: number;
    step?: number;
    onCommit(value: number): void;
}

/** On its own: drawing the field anew would put the old value back under the fingers of who types. */
function Reason({ refused, text }: { refused: ReadonlySignal<boolean>; text: string }) {
    return <>{refused.value && text}</>;
}

/**
 * Takes effect on Enter or when left; Escape takes back what was typed. What is no number of the range is refused: the value
 * stays, and the reason shows. While it has the focus it shows what is typed, whatever others do to the value.
 */
export function NumberField({ label, value, unit, min, max, step, onCommit }: Props) {
    const refused = useSignal(false);
    /** null: nothing was typed since it was entered or committed. */
    const draft = useRef<string | null>(null);
    const reasonId = useId();
    const commit = (input: HTMLInputElement): void => {
        if (draft.current === null) return;
        draft.current = null;
        const v = input.valueAsNumber;
        if (v === value) return;
        refused.value = !(v >= min && v <= max);
        if (refused.value) input.value = String(value);
        else onCommit(v);
    };
    return (
        <label class="number">
            <span class="number-label">{label}</span>
            <span class="number-box">
                <input
                    type="number"
                    aria-label={label}
                    aria-invalid={refused}
                    aria-describedby={reasonId}
                    value={draft.current ?? value}
                    min={min}
                    max={max}
                    step={step ?? 'any'}
                    onFocus={() => (refused.value = false)}
                    onInput={(e) => {
                        refused.value = false;
                        draft.current = e.currentTarget.value;
                    }}
                    onBlur={(e) => commit(e.currentTarget)}
                    onKeyDown={(e) => {
                        if (e.key === 'Enter') commit(e.currentTarget);
                        if (e.key !== 'Escape' || draft.current === null) return;
                        e.stopPropagation();
                        draft.current = null;
                        e.currentTarget.value = String(value);
                    }}
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
