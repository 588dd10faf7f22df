# What `cmake --install` installs. Each component is one of the Debian packages: osteon, osteon-server, osteon-import.
include(GNUInstallDirs)

# Off by default, because the pages are made from each program's --help, which takes several seconds.
option(OSTEON_MAN_PAGES "Make the man pages and install them" OFF)
set(osteon_man_pages ${PROJECT_BINARY_DIR}/man)
if(OSTEON_MAN_PAGES)
  add_custom_target(man_pages ALL
    COMMAND ${CMAKE_COMMAND} -E env OSTEON_BIN=${CMAKE_RUNTIME_OUTPUT_DIRECTORY}
            ${PROJECT_SOURCE_DIR}/deploy/man ${osteon_man_pages}
    COMMENT "Making the man pages" VERBATIM)
endif()

# A program, its man pages and its completion.
function(osteon_install_program name package)
  install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ${package})
  install(FILES ${PROJECT_SOURCE_DIR}/deploy/completion.bash
    DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME ${name} COMPONENT ${package})
  if(OSTEON_MAN_PAGES)
    add_dependencies(man_pages ${name})
    # The name of the window begins the names of all other programs.
    set(pages "/${name}(-[a-z-]+)?\\.1$")
    if(name STREQUAL osteon)
      set(pages "/osteon\\.1$")
    endif()
    install(DIRECTORY ${osteon_man_pages}/man1/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT ${package}
      FILES_MATCHING REGEX "${pages}")
  endif()
endfunction()

# The window and the clients: entries of the desktop's menu, an icon, the type of a case's file, access to the haptic
# devices, and a plan for the example skull.
install(FILES ${PROJECT_SOURCE_DIR}/deploy/desktop/osteon.svg
  DESTINATION ${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps COMPONENT osteon)
install(FILES ${PROJECT_SOURCE_DIR}/deploy/desktop/osteon.desktop
              ${PROJECT_SOURCE_DIR}/deploy/desktop/osteon-viewer.desktop
  DESTINATION ${CMAKE_INSTALL_DATADIR}/applications COMPONENT osteon)
install(FILES ${PROJECT_SOURCE_DIR}/deploy/desktop/osteon-case.xml
  DESTINATION ${CMAKE_INSTALL_DATADIR}/mime/packages COMPONENT osteon)
install(FILES ${PROJECT_SOURCE_DIR}/deploy/udev/70-osteon-devices.rules
  DESTINATION lib/udev/rules.d COMPONENT osteon)
install(FILES ${PROJECT_SOURCE_DIR}/deploy/session/drill-skull.json
  DESTINATION ${CMAKE_INSTALL_DATADIR}/osteon COMPONENT osteon)

# The server: its services, examples of its configuration, and the scripts for certificates and the proxy.
install(PROGRAMS ${PROJECT_SOURCE_DIR}/deploy/certs ${PROJECT_SOURCE_DIR}/deploy/proxy-revoked
  DESTINATION ${CMAKE_INSTALL_DATADIR}/osteon COMPONENT osteon-server)
install(FILES ${PROJECT_SOURCE_DIR}/deploy/osteon-server.yaml ${PROJECT_SOURCE_DIR}/deploy/haproxy.cfg
  DESTINATION ${CMAKE_INSTALL_DATADIR}/osteon COMPONENT osteon-server)
# The units of the source tree name the paths of a copy by hand.
foreach(unit osteon-server osteon-proxy osteon-proxy-revoked)
  set(file ${PROJECT_SOURCE_DIR}/deploy/systemd/${unit}.service)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  file(READ ${file} text)
  string(REPLACE "/usr/local/bin/osteon-server" "${CMAKE_INSTALL_FULL_BINDIR}/osteon-server" text "${text}")
  string(REPLACE "/usr/local/bin/proxy-revoked" "${CMAKE_INSTALL_FULL_DATADIR}/osteon/proxy-revoked" text "${text}")
  string(REGEX REPLACE "Documentation=[^\n]*" "Documentation=man:osteon-server(1)" text "${text}")
  string(REGEX REPLACE "# Copy to [^[]*" "" text "${text}")
  file(WRITE ${PROJECT_BINARY_DIR}/systemd/${unit}.service "${text}")
  install(FILES ${PROJECT_BINARY_DIR}/systemd/${unit}.service
    DESTINATION lib/systemd/system COMPONENT osteon-server)
endforeach()
