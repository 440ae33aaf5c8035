# Writes man pages and completions with the program itself. cmake -D PROGRAM=... -D FOLDER=... -P write_pages.cmake
cmake_minimum_required(VERSION 3.22)
find_program(GZIP_PROGRAM gzip REQUIRED)
set(man ${FOLDER}/man1)
file(REMOVE_RECURSE ${FOLDER})
file(MAKE_DIRECTORY ${man} ${FOLDER}/completions)

function(write file)
  execute_process(COMMAND ${PROGRAM} completion ${ARGN} OUTPUT_FILE ${file} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

write(${man}/ecaudit.1 man)
file(READ ${man}/ecaudit.1 page)
string(REGEX MATCHALL "see [^\n]*fBecaudit[^\n]*" lines "${page}")
foreach(line IN LISTS lines)
  string(REGEX REPLACE ".*ecaudit[^a-z]+([a-z]+)[^a-z].*" "\\1" command "${line}")
  write(${man}/ecaudit-${command}.1 man --command ${command})
endforeach()
file(GLOB pages ${man}/*.1)
# Without name and time, so that the same page packs into the same bytes.
execute_process(COMMAND ${GZIP_PROGRAM} -9nf ${pages} COMMAND_ERROR_IS_FATAL ANY)
write(${FOLDER}/completions/ecaudit bash)
write(${FOLDER}/completions/_ecaudit zsh)
write(${FOLDER}/completions/ecaudit.fish fish)
