/** lamp, lamp-2, lamp-3 … */
export function newId(stem: string, taken: (id: string) => boolean): string {
    let id = stem;
    for (let n = 2; taken(id); n++) id = `${stem}-${n}`;
    return id;
}

/** lamp-2 before lamp-10. */
export const byName = new Intl.Collator('en', { numeric: true }).compare;
