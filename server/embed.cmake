# cmake -DOUT=file -DNAME=symbol -DFILES=a;b -DKEYS=x;y -P embed.cmake
# Writes file.c, a table of files: const struct lum_embedded NAME[] = {{key, bytes, n}, ..., {0}} (server/base/embed.h), and file.s, which
# has their bytes: the assembler copies them, where the compiler takes ten seconds to read as many numbers.
set(declarations "")
set(table "")
set(bytes "    .section .rodata\n")
set(i 0)
foreach(file key IN ZIP_LISTS FILES KEYS)
    file(SIZE "${file}" n)
    file(SHA256 "${file}" hash) # so that file.s changes when the file does
    set(symbol ${NAME}_${i})
    string(APPEND declarations "extern const unsigned char ${symbol}[];\n")
    string(APPEND table "    {\"${key}\", ${symbol}, ${n}},\n")
    string(APPEND bytes "/* ${hash} */\n    .globl ${symbol}\n    .hidden ${symbol}\n${symbol}:\n    .incbin \"${file}\"\n    .byte 0\n")
    math(EXPR i "${i} + 1")
endforeach()
string(APPEND bytes "    .section .note.GNU-stack,\"\"\n") # or the stack would be executable
file(WRITE "${OUT}.s.tmp" "${bytes}")
file(WRITE "${OUT}.c.tmp"
    "#include \"server/base/embed.h\"\n${declarations}const struct lum_embedded ${NAME}[] = {\n${table}    {0, 0, 0},\n};\n")
foreach(part c s)
    execute_process(COMMAND ${CMAKE_COMMAND} -E copy_if_different "${OUT}.${part}.tmp" "${OUT}.${part}")
endforeach()
