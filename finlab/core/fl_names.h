/* Names of this library's functions. An export gives them those of its robot, so that two robots
   link into one program. */
