include(CMakeParseArguments)

# The folders that hold the messages of a package, found as generate_messages() finds those of its DEPENDENCIES.
function(_rosslt_message_folders package result)
  if(package STREQUAL PROJECT_NAME)
    set(${result} ${${PROJECT_NAME}_MSG_INCLUDE_DIRS_DEVELSPACE} PARENT_SCOPE)
    return()
  endif()
  set(file "share/${package}/cmake/${package}-msg-paths.cmake")
  unset(_rosslt_paths CACHE)
  find_file(_rosslt_paths ${file} PATHS ${CATKIN_DEVEL_PREFIX} ${CATKIN_WORKSPACES})
  if(NOT _rosslt_paths)
    message(FATAL_ERROR "add_tracked_message_files() found no messages of the package '${package}': looked for '${file}' in '${CATKIN_DEVEL_PREFIX};${CATKIN_WORKSPACES}' and in CMake's own search path. Is it in find_package(catkin REQUIRED COMPONENTS ...) and in package.xml?")
  endif()
  include(${_rosslt_paths})
  unset(_rosslt_paths CACHE)
  set(${result} ${${package}_MSG_INCLUDE_DIRS} PARENT_SCOPE)
endfunction()

#
# Generate a tracked message type for each of several message types, and add them to the messages of this package:
# geometry_msgs/Pose becomes PoseTracked.msg, in the devel space's share/<package>/msg.
#
# Call it after add_message_files() where it takes types of this package, and before
# generate_messages(DEPENDENCIES rosslt ...), which must name the packages of the types, too.
#
# :param TYPES: message types; the word itself may be left out
# :param NAME: what the tracked message type is called, where there is one type only
# :param NOINSTALL: do not install the generated .msg files
#
macro(add_tracked_message_files)
  cmake_parse_arguments(ARG "NOINSTALL" "NAME" "TYPES" ${ARGN})
  set(_rosslt_types ${ARG_UNPARSED_ARGUMENTS} ${ARG_TYPES})
  if(NOT _rosslt_types)
    message(FATAL_ERROR "add_tracked_message_files() called without a message type, as geometry_msgs/Pose")
  endif()
  if(${PROJECT_NAME}_GENERATE_MESSAGES)
    message(FATAL_ERROR "generate_messages() must be called after add_tracked_message_files()")
  endif()

  set(_rosslt_options -o ${CATKIN_DEVEL_PREFIX}/share/${PROJECT_NAME}/msg)
  if(ARG_NAME)
    list(APPEND _rosslt_options --name ${ARG_NAME})
  endif()
  foreach(_rosslt_type ${_rosslt_types})
    string(REGEX REPLACE "/.*" "" _rosslt_package ${_rosslt_type})
    _rosslt_message_folders(${_rosslt_package} _rosslt_folders)
    foreach(_rosslt_folder ${_rosslt_folders})
      list(APPEND _rosslt_options -I ${_rosslt_package}:${_rosslt_folder})
    endforeach()
  endforeach()

  # In the configure step, as genmsg reads the definitions in it. -B: nothing is written beside the sources.
  stamp(${rosslt_GENERATOR})
  execute_process(
    COMMAND ${CATKIN_ENV} ${CMAKE_COMMAND} -E env "PYTHONPATH=${rosslt_GENERATOR_PYTHONPATH}:$ENV{PYTHONPATH}"
      ${PYTHON_EXECUTABLE} -B ${rosslt_GENERATOR} ${_rosslt_options} ${_rosslt_types}
    RESULT_VARIABLE _rosslt_result
    OUTPUT_VARIABLE _rosslt_output
    ERROR_VARIABLE _rosslt_error
    OUTPUT_STRIP_TRAILING_WHITESPACE
  )
  if(NOT _rosslt_result EQUAL 0)
    message(FATAL_ERROR "add_tracked_message_files(${_rosslt_types}) failed:\n${_rosslt_error}")
  endif()
  string(REPLACE "\n" ";" _rosslt_output "${_rosslt_output}")
  set(_rosslt_files "")
  foreach(_rosslt_file ${_rosslt_output})
    get_filename_component(_rosslt_file ${_rosslt_file} NAME)
    list(APPEND _rosslt_files ${_rosslt_file})
  endforeach()
  message(STATUS "Generated tracked message types: ${_rosslt_files}")

  if(ARG_NOINSTALL)
    add_message_files(BASE_DIR ${CATKIN_DEVEL_PREFIX}/share/${PROJECT_NAME}/msg FILES ${_rosslt_files} NOINSTALL)
  else()
    add_message_files(BASE_DIR ${CATKIN_DEVEL_PREFIX}/share/${PROJECT_NAME}/msg FILES ${_rosslt_files})
  endif()
endmacro()
