# cmake -S . -B build -DCMAKE_TOOLCHAIN_FILE=cortex-m4f.cmake -DCMAKE_PREFIX_PATH=/path/to/gmhm -DCMAKE_EXE_LINKER_FLAGS="-T your.ld …"
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR cortex-m4)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_C_FLAGS_INIT "-Os -mthumb -mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16 -ffunction-sections")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
