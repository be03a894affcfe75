// What is checked beyond the types: npm run lint. A rule that is off, or told something, has its reason beside it.
import a11y from 'eslint-plugin-jsx-a11y';
import hooks from 'eslint-plugin-react-hooks';
import ts from 'typescript-eslint';

// The pointer's events, which the rules do not know, count as a mouse's. Keys and focus are left out: those of the controls in it
// bubble to a list or a menu, which moves the focus from one to the next.
const ACTS = { handlers: ['onClick', 'onDblClick', 'onMouseDown', 'onMouseUp', 'onPointerDown', 'onPointerUp'] };

export default ts.config({
    files: ['*/src/**/*.{ts,tsx}'], // of web and js,
    extends: [ts.configs.strictTypeChecked, a11y.flatConfigs.recommended, hooks.configs['recommended-latest']],
    languageOptions: { parserOptions: { projectService: true } },
    linterOptions: { reportUnusedDisableDirectives: 'error' },
    rules: {
        'jsx-a11y/no-static-element-interactions': ['error', ACTS],
        'jsx-a11y/no-noninteractive-element-interactions': ['error', ACTS],
        'jsx-a11y/no-noninteractive-tabindex': ['error', { roles: ['application'] }], // the picture: it takes keys
        'react-hooks/exhaustive-deps': 'off', // signals and the parts of the app never change; the list says what sets an effect off
        '@typescript-eslint/no-confusing-void-expression': 'off', // style: a call is passed on by () => call()
        '@typescript-eslint/no-non-null-assertion': 'off', // how an index that is there is written, with noUncheckedIndexedAccess
        '@typescript-eslint/unbound-method': 'off', // callbacks of an interface are written as methods; none of ours has a this
        '@typescript-eslint/restrict-template-expressions': ['error', { allowNumber: true, allowArray: true }],
        '@typescript-eslint/no-floating-promises': ['error', { allowForKnownSafeCalls: [{ from: 'package', package: 'node:test', name: 'test' }] }],
    },
});
