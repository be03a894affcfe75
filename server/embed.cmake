# cmake -DOUT=file.c -DNAME=symbol -DFILES=a;b -DKEYS=x;y -P embed.cmake
# Writes a C table of files: const struct lum_embedded NAME[] = {{key, bytes, n}, ..., {0}} (server/base/embed.h).
set(body "")
set(table "")
set(i 0)
foreach(file key IN ZIP_LISTS FILES KEYS)
    file(READ "${file}" hex HEX)
    string(REGEX REPLACE "(..)" "0x\\1," bytes "${hex}")
    string(APPEND body "static const unsigned char bytes_${i}[] = {${bytes}0};\n")
    string(APPEND table "    {\"${key}\", bytes_${i}, sizeof bytes_${i} - 1},\n")
    math(EXPR i "${i} + 1")
endforeach()
file(WRITE "${OUT}.tmp" "#include \"server/base/embed.h\"\n${body}const struct lum_embedded ${NAME}[] = {\n${table}    {0, 0, 0},\n};\n")
execute_process(COMMAND ${CMAKE_COMMAND} -E copy_if_different "${OUT}.tmp" "${OUT}")
