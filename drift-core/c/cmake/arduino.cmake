# The library for Arduino and PlatformIO, as a folder: archives for the cores that have one, where both look for them.
#   cmake -D OUT=FOLDER -P drift-core/c/cmake/arduino.cmake
# Optional: -D BUILD=FOLDER for what cargo builds. The Rust targets named below have to be installed (rustup target add).
cmake_minimum_required(VERSION 3.20)
get_filename_component(crate "${CMAKE_CURRENT_LIST_DIR}/.." ABSOLUTE)
if(NOT OUT)
  message(FATAL_ERROR "arduino.cmake: -D OUT=FOLDER is missing")
endif()
get_filename_component(OUT "${OUT}/drift" ABSOLUTE)
if(NOT BUILD)
  set(BUILD "${crate}/target")
endif()

# build.mcu of the Arduino cores, with FPU and float ABI where there are floats in registers; then the Rust target.
set(table
  "cortex-m0:thumbv6m-none-eabi"
  "cortex-m0plus:thumbv6m-none-eabi"
  "cortex-m3:thumbv7m-none-eabi"
  "cortex-m4:thumbv7em-none-eabi"
  "cortex-m4/fpv4-sp-d16-softfp:thumbv7em-none-eabi"
  "cortex-m4/fpv4-sp-d16-hard:thumbv7em-none-eabihf"
  "cortex-m7/fpv5-d16-softfp:thumbv7em-none-eabi"
  "cortex-m7/fpv5-d16-hard:thumbv7em-none-eabihf"
  "imxrt1062/fpv5-d16-hard:thumbv7em-none-eabihf"
  "cortex-m33/fpv5-sp-d16-hard:thumbv8m.main-none-eabihf"
  "esp32c3:riscv32imc-unknown-none-elf"
  "esp32c6:riscv32imac-unknown-none-elf"
  "esp32h2:riscv32imac-unknown-none-elf")
file(REMOVE_RECURSE "${OUT}")
foreach(file library.properties library.json platformio.py examples)
  file(COPY "${crate}/arduino/${file}" DESTINATION "${OUT}")
endforeach()
file(COPY "${crate}/../../examples/firmware/c/config.h" DESTINATION "${OUT}/examples/pi_loop")
file(COPY "${crate}/include/drift.h" DESTINATION "${OUT}/src")
foreach(row IN LISTS table)
  string(REPLACE ":" ";" row "${row}")
  list(POP_FRONT row folder target)
  set(made "${BUILD}/arduino/${target}/libdrift.a")
  if(NOT target IN_LIST done)
    execute_process(COMMAND "${CMAKE_COMMAND}" -D "TRIPLE=${target}" -D "OUT=${made}" -D "BUILD=${BUILD}"
                            -P "${CMAKE_CURRENT_LIST_DIR}/archive.cmake" RESULT_VARIABLE failed)
    if(failed)
      message(FATAL_ERROR "arduino.cmake: no archive for ${target}")
    endif()
    list(APPEND done ${target})
  endif()
  file(COPY "${made}" DESTINATION "${OUT}/src/${folder}")
endforeach()
message(STATUS "drift's Arduino library is ${OUT}")
