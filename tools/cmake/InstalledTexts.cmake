# Included by the install script. Changes the installed texts: their commands then hold for the
# installed program in any folder, not for the root of the repository. `share` is the folder of
# configs and datasets in the prefix.
function(rewrite_installed_texts share)
  set(prefix $ENV{DESTDIR}${CMAKE_INSTALL_PREFIX})
  foreach(pattern ${ARGN})
    file(GLOB texts ${prefix}/${pattern})
    foreach(text_file ${texts})
      file(READ ${text_file} text)
      # Removes the parts about the source, which stand between two comments.
      while(text MATCHES "<!-- source -->")
        string(FIND "${text}" "<!-- source -->" begin)
        string(FIND "${text}" "<!-- /source -->\n" end)
        math(EXPR rest "${end} + 17")
        string(SUBSTRING "${text}" 0 ${begin} before)
        string(SUBSTRING "${text}" ${rest} -1 after)
        set(text "${before}${after}")
      endwhile()
      string(REGEX REPLACE "[[]([^]]*)[]][(](docs/)?code[.]md[^)]*[)]" "\\1" text "${text}")
      string(REPLACE "build/truetriad" "truetriad" text "${text}")
      string(REGEX REPLACE "([\n =`])(configs|datasets)/"
        "\\1${CMAKE_INSTALL_PREFIX}/${share}/\\2/" text "${text}")
      file(WRITE ${text_file} "${text}")
    endforeach()
  endforeach()
endfunction()
