/** The list of lamps as lines: heads of groups and lamps, in the order in which they are shown. Which of them are in sight. */
import type { SceneRecord } from '../protocol/types';
import { byLight, grouped } from './groups';
import { matches } from './lights';

export type Line = { key: string; group: string; ids: readonly string[]; isOpen: boolean } | { key: string; id: string; inGroup: boolean };

export interface ListingInput {
    ids: readonly string[];
    record(id: string): SceneRecord | undefined;
    /** What was typed to find some. */
    filter: string;
    /** Of a lamp; as it was when the list was made: a group that is dimmed does not move away under the hand. */
    lumens(id: string): number;
    isOpen(group: string, members: readonly string[]): boolean;
}

/** Lamps that stand alone, then the groups. n: lamps that match. */
export function linesOf({ ids, record, filter, lumens, isOpen }: ListingInput): { lines: Line[]; n: number } {
    const words = filter.toLowerCase().split(/\s+/).filter((w) => w !== '');
    const found = new Set(ids.filter((id) => words.length === 0 || matches(record(id)!, words)));
    const { alone, groups } = grouped(ids, record);
    const lines: Line[] = alone.filter((id) => found.has(id)).map((id) => ({ key: id, id, inGroup: false }));
    for (const [group, members] of byLight(groups, lumens)) {
        const rows = members.filter((id) => found.has(id));
        if (rows.length === 0) continue;
        const open = words.length > 0 || isOpen(group, members);
        lines.push({ key: `group ${group}`, group, ids: members, isOpen: open });
        if (open) lines.push(...rows.map((id) => ({ key: id, id, inGroup: true })));
    }
    return { lines, n: found.size };
}

export interface Layout {
    /** Of each line, and the end of the last. */
    tops: readonly number[];
    height: number;
}

export function layoutOf(heights: readonly number[]): Layout {
    const tops: number[] = [];
    let height = 0;
    for (const h of heights) {
        tops.push(height);
        height += h;
    }
    return { tops, height };
}

/** Lines that touch [from, to), and what is kept in any case; in order. */
export function inSight({ tops, height }: Layout, from: number, to: number, kept: readonly number[]): number[] {
    const wanted = new Set(kept.filter((i) => i >= 0 && i < tops.length));
    tops.forEach((top, i) => {
        if (top < to && (tops[i + 1] ?? height) > from) wanted.add(i);
    });
    return [...wanted].sort((a, b) => a - b);
}
