# Where add_tracked_message_files() finds the generator: beside the sources, or where it was installed.
@[if DEVELSPACE]@
set(rosslt_GENERATOR "@(CMAKE_CURRENT_SOURCE_DIR)/scripts/generate_tracked_msgs.py")
set(rosslt_GENERATOR_PYTHONPATH "@(CMAKE_CURRENT_SOURCE_DIR)/src")
@[else]@
set(rosslt_GENERATOR "${rosslt_DIR}/../../../@(CATKIN_PACKAGE_BIN_DESTINATION)/generate_tracked_msgs.py")
set(rosslt_GENERATOR_PYTHONPATH "${rosslt_DIR}/../../../@(CATKIN_GLOBAL_PYTHON_DESTINATION)")
@[end if]@
