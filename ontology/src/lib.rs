//! What the robot is: OWL 2 knowledge bases, read and lowered to rules and facts.
