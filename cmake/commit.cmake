# Writes a header with the commit that the source is of: cmake -D SOURCE=FOLDER -D OUT=HEADER -P commit.cmake
# A source without git has the commit in cmake/archive_commit, if `git archive` made it; else it is not known.
set(commit "packaged source, commit not known")
file(READ ${SOURCE}/cmake/archive_commit archive)
string(STRIP "${archive}" archive)
if(archive MATCHES "^[0-9a-f]+$")
  set(commit "packaged source of commit ${archive}")
endif()
find_program(GIT git)
if(GIT AND EXISTS ${SOURCE}/.git)  # not that of a repository around an unpacked source
  execute_process(COMMAND ${GIT} -C ${SOURCE} rev-parse --short=10 HEAD
    OUTPUT_VARIABLE head OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
  if(NOT failed)
    set(commit "commit ${head}")
    execute_process(COMMAND ${GIT} -C ${SOURCE} diff --quiet HEAD RESULT_VARIABLE changed ERROR_QUIET)
    if(changed)
      string(APPEND commit ", with local changes")
    endif()
  endif()
endif()
file(WRITE ${OUT} "#define TRN_COMMIT \"${commit}\"\n")
