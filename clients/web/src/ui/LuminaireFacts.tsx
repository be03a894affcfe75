import { useSignal } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { number } from '../lib/format';
import { numberOr, stringOr, type SceneRecord } from '../protocol/types';
import { fluxOf } from '../state/lights';
import { GLARE_TITLE, glareText, type Facts } from '../state/luminaires';
import { useApp } from './context';
import { NumberField } from './NumberField';
import { Polar } from './Polar';

/** What the file of a lamp says, and how it is turned about its aim. */
export function LuminaireFacts({ light }: { light: SceneRecord }) {
    const app = useApp();
    const facts = useSignal<Facts | null>(null);
    const file = stringOr(light.asset, '');
    useEffect(() => {
        let shown = true; // an answer may come when another lamp is
        facts.value = null;
        void app.photometryOf(light.id).then((told) => {
            if (shown) facts.value = told;
        });
        return () => {
            shown = false;
        };
    }, [light.id, file]);
    const told = facts.value;
    return (
        <>
            {told && (
                <div class="luminaire">
                    <Polar polar={told.polar} label={`Polar diagram of ${light.id}`} />
                    <dl>
                        <dt>{told.name || 'Luminaire'}</dt>
                        <dd>{file || 'of its model'}</dd>
                        <dt>Gives</dt>
                        <dd>
                            {number(fluxOf(light) ?? told.fluxLm)} lm{told.watts === null ? '' : ` · ${number(told.watts)} W`}
                        </dd>
                        {told.ugr && (
                            <>
                                <dt title={GLARE_TITLE}>UGR</dt>
                                <dd title={GLARE_TITLE}>{glareText(told.ugr)}</dd>
                            </>
                        )}
                    </dl>
                </div>
            )}
            <div class="fields">
                <NumberField
                    label="Roll"
                    unit="°"
                    min={-3600}
                    max={3600}
                    step={15}
                    value={numberOr(light.roll_deg, 0)}
                    onCommit={(v) => app.edits.setOnce(light.id, '/roll_deg', v)}
                />
            </div>
        </>
    );
}
