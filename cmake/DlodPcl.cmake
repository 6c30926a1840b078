# dlod_link_pcl(TARGET COMPONENT...): links single libraries of PCL, privately. find_package(PCL) would bring VTK, Qt and
# MPI into the configuration, whatever the components.
function(dlod_link_pcl target)
  find_path(DLOD_PCL_INCLUDE_DIR pcl/point_types.h PATH_SUFFIXES pcl-1.15 pcl-1.14 pcl-1.13 pcl-1.12 REQUIRED)
  target_include_directories(${target} SYSTEM PRIVATE ${DLOD_PCL_INCLUDE_DIR})
  foreach(component ${ARGN})
    find_library(DLOD_PCL_${component}_LIBRARY pcl_${component} REQUIRED)
    target_link_libraries(${target} PRIVATE ${DLOD_PCL_${component}_LIBRARY})
  endforeach()
endfunction()
