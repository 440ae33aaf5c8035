# Man pages, completions and documents of an installation, and the packages: cpack -G "DEB;TGZ", and the target
# package_source. Included from the top, as CPack wants it.
#
# The same sources and SOURCE_DATE_EPOCH give the same bytes.
# The program writes them, so it has to run here; no other system has use for them.
if(NOT CMAKE_CROSSCOMPILING)
  set(pages ${CMAKE_BINARY_DIR}/pages)
  add_custom_command(
    OUTPUT ${pages}/completions/ecaudit.fish
    COMMAND ${CMAKE_COMMAND} -D PROGRAM=$<TARGET_FILE:ecaudit> -D FOLDER=${pages}
            -P ${CMAKE_CURRENT_LIST_DIR}/write_pages.cmake
    DEPENDS ecaudit ${CMAKE_CURRENT_LIST_DIR}/write_pages.cmake
    COMMENT "Writing man pages and completions"
    VERBATIM)
  add_custom_target(ecaudit_pages ALL DEPENDS ${pages}/completions/ecaudit.fish)

  # Who built the program alone gets its pages now.
  install(CODE "
    if(NOT EXISTS \"${pages}/completions/ecaudit.fish\")
      message(STATUS \"Writing man pages and completions\")
      execute_process(COMMAND \"${CMAKE_COMMAND}\" -D \"PROGRAM=$<TARGET_FILE:ecaudit>\" -D \"FOLDER=${pages}\"
                              -P \"${CMAKE_CURRENT_LIST_DIR}/write_pages.cmake\" COMMAND_ERROR_IS_FATAL ANY)
    endif()")
  install(DIRECTORY ${pages}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR})
  install(FILES ${pages}/completions/ecaudit DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
  install(FILES ${pages}/completions/_ecaudit DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions)
  install(FILES ${pages}/completions/ecaudit.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
endif()

set(doc ${CMAKE_INSTALL_DATADIR}/doc/ecaudit)
install(FILES ${CMAKE_CURRENT_LIST_DIR}/copyright ${PROJECT_SOURCE_DIR}/docs/report.png DESTINATION ${doc})
# In one folder, with the schemas elsewhere and without the tests: links go where things are then.
file(GLOB documents CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/docs/*.md)
foreach(document IN LISTS documents ITEMS ${PROJECT_SOURCE_DIR}/README.md)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${document})
  cmake_path(GET document FILENAME name)
  file(READ ${document} text)
  string(REPLACE "](docs/" "](" text "${text}")
  string(REPLACE "](../README.md" "](README.md" text "${text}")
  string(REGEX REPLACE "\\]\\((\\.\\./)?cli/report/" "](../../ecaudit/" text "${text}")
  string(REPLACE "](LICENSE)" "](copyright)" text "${text}")
  string(REGEX REPLACE "\\[([^]\n]*)\\]\\((\\.\\./)?tests/README\\.md\\)" "\\1" text "${text}")
  file(WRITE ${CMAKE_BINARY_DIR}/packaging/documents/${name} "${text}")
  install(FILES ${CMAKE_BINARY_DIR}/packaging/documents/${name} DESTINATION ${doc})
endforeach()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs/ci DESTINATION ${doc})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/samples/captures ${PROJECT_SOURCE_DIR}/samples/descriptions
                  ${PROJECT_SOURCE_DIR}/samples/families
        DESTINATION ${doc}/examples)
# Who builds a package is who hands it out: as Debian's own tools ask, else as git knows the builder.
function(package_builder result)
  set(name "$ENV{DEBFULLNAME}")
  set(mail "$ENV{DEBEMAIL}")
  find_program(GIT_PROGRAM git)
  foreach(part name mail)
    if(NOT ${part} AND GIT_PROGRAM)
      string(REPLACE "mail" "email" key ${part})
      execute_process(COMMAND ${GIT_PROGRAM} config user.${key} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
                      OUTPUT_VARIABLE ${part} OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    endif()
  endforeach()
  if(NOT name OR NOT mail)
    message(STATUS "nobody is named as the maintainer of packages: set DEBFULLNAME and DEBEMAIL, or CPACK_PACKAGE_CONTACT")
    set(name "unknown")
    set(mail "unknown@localhost.invalid")
  endif()
  set(${result} "${name} <${mail}>" PARENT_SCOPE)
endfunction()
package_builder(builder)
set(CPACK_PACKAGE_CONTACT "${builder}" CACHE STRING "Who maintains the package")
# Debian wants its own changelog, compressed.
find_program(GZIP_PROGRAM gzip)
if(GZIP_PROGRAM)
  set(changelog ${CMAKE_BINARY_DIR}/packaging/changelog)
  configure_file(${CMAKE_CURRENT_LIST_DIR}/changelog.in ${changelog} @ONLY)
  execute_process(COMMAND ${GZIP_PROGRAM} -9nfk ${changelog})
  install(FILES ${changelog}.gz DESTINATION ${doc})
endif()

set(CPACK_PACKAGE_NAME ecaudit)
set(CPACK_PACKAGE_VENDOR "the ecaudit authors")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Offline analyzer for captures of EtherCAT traffic")
set(CPACK_PACKAGE_DESCRIPTION
    "Reads captures (pcap, pcapng), replays them through a model of every
EtherCAT slave, and reports what is wrong: refused state changes, wrong
configurations, aborted transfers, faults of drives, lost synchronisation,
each with its frames, the section of the manual and what to do. Reports as
text, JSON, JUnit, SARIF and HTML.")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_STRIP_FILES ON)
set(CPACK_GENERATOR DEB TGZ)
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION net)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SUGGESTS wireshark)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
# The build folder may lie in another umask than that of packages.
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ
    WORLD_EXECUTE)
set(CPACK_SOURCE_GENERATOR TGZ)
set(CPACK_SOURCE_PACKAGE_FILE_NAME ecaudit-${PROJECT_VERSION})
set(CPACK_SOURCE_IGNORE_FILES "${PROJECT_SOURCE_DIR}/build/" "/\\.git$" "/\\.git/" "/\\.cache/" "/node_modules/" "/__pycache__/"
    "~$" "\\.orig$")
include(CPack)
