// Nothing: the target of this source makes the precompiled headers of pch_seldom.h, for all that run seldom.
