"""What an ATI Ethernet sensor tells on its page."""

PAGE = """<?xml version="1.0"?><netft>
<runstat>0x00000000</runstat><runrate>7000</runrate><cfgnam>empty</cfgnam>
<cfgcalsel>0</cfgcalsel><cfgcalsn>FT27462</cfgcalsn><scfgfu>N</scfgfu><scfgtu>Nm</scfgtu>
<cfgtfx>0;0;132.710;0;0;0</cfgtfx><cfgcpf>1000000</cfgcpf><cfgcpt>1000000</cfgcpt>
<cfgmr>330;330;990;30;30;30</cfgmr><setuserfilter>0</setuserfilter><comrdte>Enabled</comrdte>
<comrdtrate>100</comrdtrate><mfgdigver>2.2.59</mfgdigver></netft>"""
"""Entries as the page of a Gamma SI-330-30 with firmware 2.2.59 has them."""
