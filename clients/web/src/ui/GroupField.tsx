import { useId } from 'preact/hooks';
import { stringOr, type SceneRecord } from '../protocol/types';
import { useApp } from './context';

interface Props {
    /** Of what is in it. */
    name: string;
    lights: readonly SceneRecord[];
    onCommit(group: string): void;
}

/** Lamps of one group are dimmed together; one that there is already can be chosen. */
export function GroupField({ name, lights, onCommit }: Props) {
    const app = useApp();
    const listId = useId();
    const groups = [...new Set(lights.map((l) => stringOr(l.group, '')))];
    const group = groups.length === 1 ? groups[0]! : '';
    const names = [...new Set(app.scene.lamps.value.map((id) => stringOr(app.scene.peek(id)?.group, '')))].filter((n) => n !== '').sort();
    const commit = (input: HTMLInputElement): void => {
        const typed = input.value.trim().replace(/[^A-Za-z0-9_.:/-]+/g, '-').slice(0, 64);
        input.value = typed;
        if (typed === group || input.dataset.sent === typed) return;
        input.dataset.sent = typed; // once made anew for the new group it is left, too
        onCommit(typed);
    };
    return (
        <label class="group-field">
            <span class="field-label">Group</span>
            <input
                key={groups.join(' ')}
                type="text"
                aria-label={`${name} group`}
                placeholder={groups.length > 1 ? 'mixed' : 'none'}
                spellcheck={false}
                autocomplete="off"
                maxLength={64}
                list={listId}
                defaultValue={group}
                onBlur={(e) => commit(e.currentTarget)}
                onKeyDown={(e) => e.key === 'Enter' && commit(e.currentTarget)}
            />
            <datalist id={listId}>
                {names.map((n) => (
                    <option key={n} value={n} />
                ))}
            </datalist>
        </label>
    );
}
