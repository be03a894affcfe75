import type { Vec3 } from '../lib/vec';
import { NumberField } from './NumberField';

interface Props {
    /** Of the group. */
    label: string;
    names: readonly [string, string, string];
    value: Vec3;
    unit: string;
    limits: readonly [number, number];
    step: number;
    onCommit(value: Vec3): void;
}

/** Three numbers in a row; to three decimals, which is a millimetre where they are metres. */
export function VectorFields({ label, names, value, unit, limits, step, onCommit }: Props) {
    return (
        <div class="fields" role="group" aria-label={label}>
            {names.map((name, axis) => (
                <NumberField
                    key={name}
                    label={name}
                    value={Number(value[axis]!.toFixed(3))}
                    unit={unit}
                    min={limits[0]}
                    max={limits[1]}
                    step={step}
                    onCommit={(v) => onCommit(value.map((old, i) => (i === axis ? v : old)) as unknown as Vec3)}
                />
            ))}
        </div>
    );
}
