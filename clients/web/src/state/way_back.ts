/** The "Undo" of what says that something was removed. */
import { stringOr, type SceneRecord } from '../protocol/types';
import type { Edits } from './edits';
import { addOf } from './scene_ops';
import type { Toasts } from './toasts';

/**
 * edits, toasts: of the page; step: that of the removal; records: as they were.
 *
 * Undo takes the last step back, and that may be another one by now: then they are made again. What came with a model, and a model, is
 * made by undo alone.
 */
export function wayBack(edits: Edits, toasts: Toasts, step: number, records: readonly SceneRecord[]): () => void {
    const again = records.filter((r) => r.type !== 'import' && stringOr(r.origin, '') === '').map((r) => addOf(r));
    return () => {
        if (edits.step === step) void edits.undo();
        else if (again.length > 0) void edits.transaction(again);
        else toasts.info('It came with a model: undo what you changed since, and then its removal, with Z');
    };
}
